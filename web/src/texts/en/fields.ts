// The form of all other fields.
export const ofFields = {
  fields: {
    ofWaypoint: 'More fields of this waypoint',
    ofRequest: 'Fields of the whole request',
    ofBackend: (kind: string) => `Options of ${kind}`,
    remove: (field: string) => `Remove ${field}`,
    another: 'Another',
    many: (count: number) => `${count} entries, too many for a form: edit them as JSON, under “Request”.`,
    kind: 'Kind',
    name: 'Name',
    usual: 'as usual',
    range: ['from', 'to'],
    words: {
      true: 'yes',
      false: 'no',
      free: 'tolerance region',
      ik: 'inverse kinematics',
      rotation_z: 'free rotation about z',
      half_space: 'plane',
    } as Record<string, string>,
  },
};
