import tseslint from 'typescript-eslint';

// Signals that a file imports are written by functions of src/state alone.
const signals = {
  rules: {
    'written-in-state': {
      create: (context) => ({
        'AssignmentExpression[left.type="MemberExpression"][left.property.name="value"][left.object.type="Identifier"]'({ left }) {
          const { references } = context.sourceCode.getScope(left);
          const isImported = references.some(
            ({ identifier, resolved }) => identifier === left.object && resolved?.defs[0]?.type === 'ImportBinding',
          );
          if (isImported) context.report({ node: left, message: `\`${left.object.name}\` must be written by a function of src/state.` });
        },
      }),
    },
  },
};

export default tseslint.config(
  { ignores: ['node_modules', 'src/service/openapi.d.ts', 'eslint.config.js'] },
  ...tseslint.configs.strictTypeChecked,
  {
    languageOptions: { parserOptions: { projectService: true, tsconfigRootDir: import.meta.dirname } },
    rules: {
      'max-lines': ['error', { max: 300 }],
      '@typescript-eslint/restrict-template-expressions': ['error', { allowNumber: true }],
      '@typescript-eslint/no-confusing-void-expression': ['error', { ignoreArrowShorthand: true }],
      '@typescript-eslint/no-unused-expressions': 'off', // reading a signal subscribes to it
      '@typescript-eslint/no-non-null-assertion': 'off', // rows of arrays whose lengths are known
    },
  },
  { ignores: ['src/state/**', '**/*.test.ts'], plugins: { signals }, rules: { 'signals/written-in-state': 'error' } },
);
