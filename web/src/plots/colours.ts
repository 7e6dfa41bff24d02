// The colours of the joints, in turn: told apart by colour-blind eyes, 3:1 on light and on dark.
export const JOINT_COLOURS: readonly string[] = ['#2f86cf', '#d9622b', '#1f9872', '#bf63a8', '#a87b00', '#4a98b8', '#8a66cf'];

export function jointColour(joint: number): string {
  return JOINT_COLOURS[joint % JOINT_COLOURS.length]!;
}
