// What the colours of a view say. Shaders that draw them: film/view.wgsl and the shade pass of each technique.

const legends: Record<string, string> = {
  albedo: 'Base colour of the surface, linear.',
  normal: 'Shading normal in world space: x, y and z from −1 to 1 as red, green and blue.',
  depth: 'Distance along the view axis: black at the camera, half grey at one radius of the scene, towards white beyond.',
  motion: 'How far what is seen has moved in the picture: grey at rest, redder to the right, greener down; full at 16 pixels.',
  direct: 'Light that comes straight from lights.',
  indirect: 'Light that has scattered more than once.',
  'contribution weight': 'p̂ W of the reservoir: the estimate of direct light before its shadow ray; W itself has no scale of its own.',
  'confidence weight': 'c of the reservoir: white at the most that history and neighbours can give.',
  light: 'A colour for each light that is chosen; black where none is.',
  duplicates: 'How many pixels within 5 hold the very same sample: black for none, over red and yellow to white for all.',
  candidate: 'The share that this frame\'s candidate has in direct light.',
  temporal: 'The share that the history has in direct light.',
  spatiotemporal: 'The share that the history of a pixel nearby has in direct light.',
  subset: 'A colour for each subset of lights that a tile draws from.',
  'area lights': 'Direct light by the reservoir of area lights.',
  'point lights': 'Direct light by the reservoir of point lights.',
  'samples count': 'Samples that the reservoirs count: red of area lights, green of point lights; full at twice what history may hold.',
  'not finite': 'Weights that are no numbers: red of area lights, green of point lights; dark where all is well.',
};

/** The legend of a view in one sentence; nothing for the picture itself. */
export const legendOf = (view: string): string => legends[view] ?? '';
