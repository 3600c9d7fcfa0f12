// Takes the steps of a session by the functions of hairnet.wasm, and compares what they give with the native library's.
//   node header_session.mjs hairnet.wasm FOLDER
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { start } from "../../client/wasm/glue.mjs";
import { compare, lineOf } from "./lines.mjs";

const [path, folder] = process.argv.slice(2);
const module = await start(readFileSync(path));
const memory = () => module.memory.buffer;
const uint32At = (at) => new DataView(memory()).getUint32(at, true);
const bytesAt = (at, size) => Buffer.from(new Uint8Array(memory(), at, size)); // a copy
const textAt = (at) => {
  const all = new Uint8Array(memory(), at);
  return Buffer.from(all.subarray(0, all.indexOf(0))).toString();
};
const copied = (bytes) => {
  const at = module.malloc(bytes.length);
  new Uint8Array(memory()).set(bytes, at);
  return at;
};

// Struct Step of session.hpp, as its writer writes it.
function* steps(bytes) {
  for (let at = 0; at < bytes.length; ) {
    const size = bytes.readUInt32LE(at + 9);
    yield { kind: bytes[at], now: bytes.readBigInt64LE(at + 1), bytes: bytes.subarray(at + 13, at + 13 + size) };
    at += 13 + size;
  }
}
const [PACKET, ADD, POSE, LOSE] = [1, 2, 3, 4];

const all = [...steps(readFileSync(join(folder, "session")))];
const slot = module.malloc(64), event = module.malloc(64), shown = module.malloc(416), nodesAt = module.malloc(1 << 16);
module.hairnet_open(0, all[0].now, slot, 0, 0);
const room = uint32At(slot);
let groom = 0, events = "";
const sent = [], nodes = [], sources = [], lattices = [], swing = [];
let pictureSum = 0;
module.hairnet_picture_make(slot);
const picture = uint32At(slot);

// As class Pictures of header_session.cpp.
const [kShown, kDrawn, kRecord, kHeads] = [416, 488, 340, 16];
const everyone = module.malloc(kShown * kHeads), drawn = module.malloc(kDrawn * kHeads);
function draw(scene) {
  const count = module.hairnet_shown_count(scene);
  module.hairnet_get_shown(scene, 0, everyone, count);
  const view = new DataView(memory());
  let n = 0;
  for (let i = 0; i < count; ++i) {
    const [from, at] = [everyone + kShown * i, drawn + kDrawn * n];
    if (view.getUint32(from + 24, true) === 0) continue;
    const all = new Uint8Array(memory());
    all.fill(0, at, at + kDrawn).copyWithin(at, from + 56, from + 336);
    for (const [place, word] of [[280, view.getUint32(from, true)], [288, scene], [296, i], [300, n], [396, 5000], [476, 1]])
      view.setUint32(at + place, word, true);
    const floats = [[348, -1.5], [400, 4e-4], [480, 100], [484, 0.5]];
    for (let axis = 0; axis < 3; ++axis) floats.push([428 + 4 * axis, -0.25], [440 + 4 * axis, 0.25]);
    for (const [place, number] of floats) view.setFloat32(at + place, number, true);
    n += 1;
  }
  module.hairnet_choose_details(drawn, n, 1);
  module.hairnet_picture_write(picture, drawn, n, 0, 2048, slot);
  const [records, recordCount, , , , sourcesAt, sourceCount] = new Uint32Array(memory(), slot, 8);
  for (let s = 0; s < sourceCount; ++s) {
    const [basis, , index, first, end] = new Uint32Array(memory(), sourcesAt + 20 * s, 5);
    sources.push(basis, index, first, end);
  }
  for (let r = 0; r < recordCount; ++r) {
    const record = new Float32Array(memory(), records + 4 * kRecord * r, kRecord);
    lattices.push(...record.subarray(64, 76), ...record.subarray(84));
    pictureSum += record.reduce((a, b) => a + b, 0);
  }
  module.hairnet_picture_motions(picture, drawn, n, slot);
  const [motions, motionCount, swingAt] = new Uint32Array(memory(), slot, 3);
  swing.push(...new Uint16Array(memory(), swingAt, 4 * 512 * motionCount));
  for (let m = 0; m < motionCount; ++m)
    pictureSum += new Float64Array(memory(), motions + 264 * m + 128, 16).reduce((a, b) => a + b, 0);
}

for (const { kind, now, bytes } of all) {
  module.hairnet_poll(room, now);
  if (module.hairnet_wants_connection(room, 0, 0)) {
    module.hairnet_on_opening(room, now);
    module.hairnet_on_open(room, 0, now);
  }
  const at = copied(bytes);
  if (kind === PACKET) module.hairnet_on_bytes(room, at, bytes.length, now);
  if (kind === ADD) {
    module.hairnet_groom_load(at, bytes.length, slot, 0, 0);
    groom = uint32At(slot);
    module.hairnet_add_character(room, groom, 0, 0, 0, 0);
  }
  if (kind === POSE) module.hairnet_push_pose(room, 1, at, 0);
  module.free(at);
  if (kind === LOSE) {
    const why = copied(Buffer.from("the cable\0"));
    module.hairnet_on_closed(room, why, now);
    module.free(why);
  }
  module.hairnet_advance(room);
  while (module.hairnet_next_event(room, event))
    events += `${uint32At(event)} ${uint32At(event + 8)} ${textAt(uint32At(event + 40))}\n`;
  for (let packet = 0; (packet = module.hairnet_take_packet(room, now, slot, 0)); ) sent.push(bytesAt(packet, uint32At(slot)));
  const scene = module.hairnet_room_scene(room);
  for (let i = 0; i < module.hairnet_shown_count(scene); ++i) {
    module.hairnet_get_shown(scene, i, shown, 1);
    if (uint32At(shown + 32) === 0) continue;
    const count = [392, 396, 400].reduce((product, at) => product * uint32At(shown + at), 1);
    module.hairnet_shown_nodes(scene, i, nodesAt, count);
    nodes.push(bytesAt(nodesAt, 12 * count));
  }
  draw(scene);
}
const pointCount = module.hairnet_groom_point_count(groom);
const pointsAt = module.malloc(12 * pointCount);
const error = module.hairnet_shown_points(module.hairnet_room_scene(room), 0, pointsAt, 0, pointCount);
const sum = new Float32Array(memory(), pointsAt, 3 * pointCount).reduce((a, b) => a + b, 0);
module.hairnet_picture_free(picture);
new DataView(memory()).setFloat64(slot, 0.3, true);
new DataView(memory()).setFloat64(slot + 8, -0.2, true);
new DataView(memory()).setFloat64(slot + 16, 1, true);
module.hairnet_studio_lights(slot, everyone);
const light = [...new Float32Array(memory(), everyone + 12, 3)];
module.hairnet_groom_free(groom);
module.hairnet_room_free(room);

const got = [
  lineOf("hairnet.h session: packets sent", 1, Buffer.concat(sent)),
  lineOf("hairnet.h session: events", 1, Buffer.from(events)),
  lineOf("hairnet.h session: nodes shown", 4, Buffer.concat(nodes)),
  lineOf("hairnet.h session: error of points", 4, Buffer.from(new Int32Array([error]).buffer)),
  `~0.01 hairnet.h session: sum of points ${sum}`,
  lineOf("hairnet.h session: sources of pictures", 4, Buffer.from(Uint32Array.from(sources).buffer)),
  lineOf("hairnet.h session: lattices in records", 4, Buffer.from(Float32Array.from(lattices).buffer)),
  lineOf("hairnet.h session: swing", 2, Buffer.from(Uint16Array.from(swing).buffer)),
  `~0.001 hairnet.h session: sum of records and motions, a light ${[pictureSum, ...light].join(" ")}`,
];
compare(got, readFileSync(join(folder, "header_expected"), "utf8"));
