// The channels that the page shows: which planes of a tile each is made from, which of TileFormat brings them, and how
// its value is formed. shaders.js forms the same values; change both.

// How the planes become what is shown.
export const Kind = { RGB: 0, SCALAR: 1, STANDARD_ERROR: 2, RELATIVE_ERROR: 3, NORMAL: 4, RATIO: 5 };

const COLOUR = ['R', 'G', 'B'];
const VARIANCE = ['variance.R', 'variance.G', 'variance.B'];

export const channels = [
  {
    id: 'display',
    name: 'Display',
    kind: Kind.RGB,
    planes: ['display.R', 'display.G', 'display.B'],
    needs: ['display'],
    about: 'Filtered along surfaces and blended with the film by their errors. Biased; becomes the film.',
  },
  {
    id: 'radiance',
    name: 'Radiance',
    kind: Kind.RGB,
    planes: COLOUR,
    needs: [],
    about: 'The film: mean radiance, linear Rec.709, unfiltered.',
  },
  {
    id: 'error',
    name: 'Standard error',
    kind: Kind.STANDARD_ERROR,
    planes: VARIANCE,
    needs: ['variance'],
    log: true,
    about: 'Root of the variance of the pixel mean, root mean square over the channels.',
  },
  {
    id: 'relative',
    name: 'Relative error',
    kind: Kind.RELATIVE_ERROR,
    planes: [...VARIANCE, ...COLOUR],
    needs: ['variance'],
    log: true,
    about: 'Standard error over the pixel mean, which counts as 1 % of the mean of the picture at least.',
  },
  {
    id: 'displayerror',
    name: 'Display error',
    kind: Kind.SCALAR,
    planes: ['display.error'],
    needs: ['display'],
    log: true,
    about: 'Estimated root mean square error of the display channel.',
  },
  {
    id: 'samples',
    name: 'Samples',
    kind: Kind.SCALAR,
    planes: ['samples'],
    needs: ['samples'],
    about: 'Valid samples of a pixel, carried ones included.',
  },
  {
    id: 'density',
    name: 'Sample density',
    kind: Kind.SCALAR,
    planes: ['samples.density'],
    needs: ['density'],
    about: 'Fresh samples of a pixel over their mean.',
  },
  {
    id: 'weight',
    name: 'History weight',
    kind: Kind.SCALAR,
    planes: ['history.weight'],
    needs: ['history'],
    range: [0, 1],
    about: 'Weight of earlier pictures in the mean.',
  },
  {
    id: 'age',
    name: 'History age',
    kind: Kind.RATIO,
    planes: ['history.age', 'history.weight'],
    needs: ['history'],
    about: 'Camera moves since the history was traced.',
  },
  {
    id: 'bound',
    name: 'Bias bound',
    kind: Kind.SCALAR,
    planes: ['bias.bound'],
    needs: ['history'],
    log: true,
    about: 'Bound on the error that history may have left in the mean.',
  },
  {
    id: 'albedo',
    name: 'Albedo',
    kind: Kind.RGB,
    planes: ['albedo.r', 'albedo.g', 'albedo.b'],
    needs: ['albedo'],
    about: 'Albedo of the first hit.',
  },
  {
    id: 'normal',
    name: 'Normal',
    kind: Kind.NORMAL,
    planes: ['N.x', 'N.y', 'N.z'],
    needs: ['normal'],
    about: 'Mean shading normal in world space; red x, green y, blue z.',
  },
  {
    id: 'depth',
    name: 'Depth',
    kind: Kind.SCALAR,
    planes: ['Z'],
    needs: ['depth'],
    about: 'Distance to the first hit.',
  },
];

export const channelById = (id) => channels.find((channel) => channel.id === id) ?? channels[0];
export const isColour = (channel) => channel.kind === Kind.RGB || channel.kind === Kind.NORMAL;
export const planesForError = [...VARIANCE, 'samples']; // that differences in standard errors need

// TileFormat that brings all that is needed. needs: a Set of 'variance', 'samples', 'display', 'depth', ...
export function tileFormat(needs, extra) {
  return {
    without_variance: !needs.has('variance'),
    without_samples: !needs.has('samples'),
    depth: needs.has('depth'),
    normal: needs.has('normal'),
    albedo: needs.has('albedo'),
    history: needs.has('history'),
    density: needs.has('density'),
    display: needs.has('display'),
    ...extra,
  };
}

// The value of a channel in a pixel: one number, or three of a colour. at(plane) answers the plane's number there;
// floor: the least mean that a relative error is told of.
export function valueOf(channel, at, floor) {
  const planes = channel.planes.map(at);
  const mean = (a, b, c) => (a + b + c) / 3;
  switch (channel.kind) {
    case Kind.STANDARD_ERROR:
      return Math.sqrt(mean(...planes));
    case Kind.RELATIVE_ERROR:
      return Math.sqrt(mean(...planes.slice(0, 3))) / Math.max(mean(...planes.slice(3)), floor);
    case Kind.RATIO:
      return planes[1] > 0 ? planes[0] / planes[1] : 0;
    case Kind.SCALAR:
      return planes[0];
    default:
      return planes;
  }
}
