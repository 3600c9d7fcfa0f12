/** The size of a `hairnet_drawn` of client/hairnet.h in the module's memory, bytes. */
export const kDrawnBytes = 488;
/** The places of its fields, bytes; `origin`, `spacing` and `counts` are those of its lattice. */
export enum At {
  pose = 0,
  id = 280,
  scene = 288,
  nodes = 292,
  index = 296,
  record = 300,
  origin = 304,
  spacing = 316,
  counts = 328,
  scale = 348,
  hair = 352,
  hairTip = 364,
  skin = 376,
  roughness = 388,
  hidesBody = 392,
  strandCount = 396,
  strandWidth = 400,
  detail = 404,
  firstRow = 420,
  rowCount = 424,
  box = 428,
  rootBox = 452,
  hasLight = 476,
  headPx = 480,
  ballRadius = 484,
}
/** The `record` of a character that is not drawn: HAIRNET_NOT_DRAWN of client/hairnet.h. */
export const kNotDrawn = 0xffffffff;
