import { boneIndex, jointOf, kBones } from "./skeleton";
import { GlbBytes, SkinnedMeshBytes, type Colour, type Joints, type Vector } from "./glb";

export interface MadeAvatarOptions {
  /** The version of VRM: a model of version 0 looks along -Z, and one of version 1 along +Z. By default it is 1. */
  version?: 0 | 1;
  /** The factor on the size of the head about its joint; by default 1. */
  headSize?: number;
  /** The name of a second layer on the scalp, as models with their own hair have it; by default there is none. */
  hairMesh?: string;
}

const kSkin: Colour = [0.74, 0.45, 0.33];
const kBlush: Colour = [0.76, 0.27, 0.22];
const kLip: Colour = [0.48, 0.12, 0.1];
const kWhite: Colour = [0.82, 0.81, 0.79];
const kIris: Colour = [0.1, 0.16, 0.09];
const kGlint: Colour = [1, 1, 1];
const kPupil: Colour = [0.008, 0.008, 0.01];
const kBrow: Colour = [0.06, 0.032, 0.02];
const kJumper: Colour = [0.045, 0.14, 0.17];
const kCollar: Colour = [0.5, 0.42, 0.3];
const kTrousers: Colour = [0.035, 0.04, 0.06];
const kShoes: Colour = [0.5, 0.45, 0.38];

/** The middle of the skull from the head joint, m. */
const kSkull: Vector = [0, 0.078, 0.006];
/** The factor from the shapes below to the model: its head is a little larger than a real person's. */
const kHeadScale = 1.06;

/** A person made by code, as the bytes of a VRM file, without hair: it needs no licence of another person. */
export function makeAvatar(options: MadeAvatarOptions = {}): Uint8Array<ArrayBuffer> {
  const { version = 1, headSize = 1, hairMesh } = options;
  const body = new SkinnedMeshBytes("Body", 0.85);
  const face = new SkinnedMeshBytes("Face", 0.62);
  const eyes = new SkinnedMeshBytes("Eyes", 0.2);
  addClothes(body, Math.min(headSize, 1));
  addHead(face, eyes, headSize);
  const meshes = [body, face, eyes];
  if (hairMesh) {
    const layer = new SkinnedMeshBytes(hairMesh, 0.6);
    // The layer covers the upper 62 % of the way from the crown to the chin, 12 % further out than the skin.
    const upper = (along: number, around: number) => onHead(headPoint(0.62 * along, around), 1.12 * headSize);
    layer.addSkin(24, 32, upper, only("head"), () => kBrow);
    meshes.push(layer);
  }
  return vrmFile(meshes, version);
}

/**
 * The surface of the head: an egg with a jaw, a nose, eye sockets and a chin. `along` goes from 0 at the crown to 1
 * below the chin, and `around` from 0 in front over the left side back to 1. Returns a place from the middle of the
 * skull, m.
 */
function headPoint(along: number, around: number): Vector {
  // At the very poles a ring of the skin would have no size, and no normals.
  const polar = Math.PI * Math.min(Math.max(along, 0.003), 0.997);
  const turn = 2 * Math.PI * around;
  const [x, y, z] = [Math.sin(polar) * Math.sin(turn), Math.cos(polar), Math.sin(polar) * Math.cos(turn)];
  const low = Math.max(-y, 0);
  const front = Math.max(z, 0);
  // A soft bump of height 1 on the front, at both sides of the middle: a Gaussian about (atX, atY) on the unit sphere.
  // The factors below are heights in m.
  const bump = (atX: number, atY: number, width: number, height: number) =>
    front * Math.exp(-(((Math.abs(x) - atX) / width) ** 2) - ((y - atY) / height) ** 2);
  const nose = 0.012 * bump(0, -0.2, 0.1, 0.1) + 0.004 * bump(0, -0.02, 0.09, 0.2);
  const sockets = -0.005 * bump(0.4, -0.03, 0.26, 0.18);
  const cheeks = 0.004 * bump(0.5, -0.36, 0.3, 0.22);
  const chin = 0.006 * bump(0, -0.85, 0.2, 0.16);
  const lips = 0.002 * bump(0, -0.5, 0.18, 0.09);
  const narrow = 1 - 0.32 * low ** 1.7;
  const skull = [
    0.0745 * x * narrow,
    y > 0 ? 0.106 * y ** 0.88 : 0.108 * y,
    (z > 0 ? 0.096 * (1 - 0.08 * low) : 0.099) * z * (1 - 0.18 * low ** 2 * (z < 0 ? 1.8 : 0.3)),
  ];
  const out = nose + sockets + cheeks + chin + lips;
  return [skull[0] + x * 0.4 * (cheeks + sockets), skull[1] - 0.25 * nose, skull[2] + out];
}

/** The place of the face's surface in front of a point, from the skull's middle. */
function faceZ(x: number, y: number): number {
  const along = Math.acos(Math.max(y > 0 ? (y / 0.106) ** 1.136 : y / 0.108, -1)) / Math.PI;
  const [widest] = headPoint(along, 0.25);
  return headPoint(along, Math.asin(Math.min(x / widest, 1)) / (2 * Math.PI))[2];
}

/** From the skull's middle to the model at rest. */
function onHead(at: Vector, size: number): Vector {
  const joint = jointOf("head");
  const scale = kHeadScale * size;
  return [0, 1, 2].map((axis) => joint[axis] + scale * (at[axis] + kSkull[axis])) as unknown as Vector;
}

function addHead(face: SkinnedMeshBytes, eyes: SkinnedMeshBytes, size: number): void {
  const head = only("head");
  const colour = (point: Vector) => {
    const [x, y, z] = point.map((v, axis) => (v - jointOf("head")[axis]) / (kHeadScale * size) - kSkull[axis]);
    const glow = z < 0 ? 0 : Math.exp(-(((Math.abs(x) - 0.042) / 0.019) ** 2) - ((y + 0.038) / 0.017) ** 2);
    return mix(kSkin, kBlush, 0.6 * glow);
  };
  face.addSkin(52, 64, (along, around) => onHead(headPoint(along, around), size), head, colour);
  const egg = (mesh: SkinnedMeshBytes, at: Vector, radii: Vector, tint: Colour, yaw = 0) =>
    mesh.addSkin(
      14,
      20,
      (along, around) => onHead(eggPoint(along, around, at, radii, yaw), size),
      head,
      () => tint,
    );
  // For each side these are the ear, the white of the eye, iris, pupil, a glint in it, the upper lid, and then the lash
  // and the brow. Places are from the middle of the skull, m.
  for (const side of [1, -1]) {
    egg(face, [0.0745 * side, -0.016, -0.01], [0.008, 0.024, 0.015], kSkin, -0.4 * side);
    egg(eyes, [0.0315 * side, -0.003, 0.0755], [0.0175, 0.0165, 0.0125], kWhite, 0.3 * side);
    egg(eyes, [0.0318 * side, -0.0035, 0.0812], [0.0112, 0.0124, 0.0078], kIris, 0.22 * side);
    egg(eyes, [0.0319 * side, -0.0035, 0.0842], [0.0062, 0.0069, 0.0055], kPupil, 0.2 * side);
    egg(eyes, [0.032 * side - 0.0035, 0.0012, 0.0884], [0.0023, 0.0026, 0.0012], kGlint);
    egg(face, [0.0315 * side, 0.0118, 0.0748], [0.0184, 0.0135, 0.0132], kSkin, 0.3 * side);
    // The lash bends back with the eyeball, and the brow lies 1 mm before the skin.
    const lash = (x: number) => 0.0885 - 32 * (x - 0.0315) ** 2;
    face.addSkin(18, 8, tubeAlongArc(side, [0.032, 0.0042], 0.0178, 0.009, 0.0019, lash, size), head, () => kBrow);
    const brow = (x: number, y: number) => faceZ(x, y) + 0.001;
    face.addSkin(18, 8, tubeAlongArc(side, [0.034, 0.0305], 0.0175, 0.005, 0.0026, brow, size), head, () => kBrow);
  }
  face.addSkin(24, 8, tubeAlongArc(1, [0, -0.0535], 0.019, -0.0062, 0.0023, faceZ, size), head, () => kLip);
}

/**
 * A thin tube across the face, thick in the middle; its middle is `bend` above its ends. `surface`: the z of its line.
 */
function tubeAlongArc(
  side: number,
  at: readonly [number, number],
  halfWidth: number,
  bend: number,
  thick: number,
  surface: (x: number, y: number) => number,
  size: number,
) {
  return (along: number, around: number): Vector => {
    const s = 2 * along - 1;
    const radius = thick * Math.sqrt(Math.max(1 - s * s, 1e-4));
    const turn = 2 * Math.PI * around * side;
    const x = at[0] + halfWidth * s;
    const y = at[1] + bend * (1 - s * s) - 0.4 * bend;
    const z = surface(Math.abs(x), y);
    return onHead([side * x, y + radius * Math.sin(turn), z + radius * Math.cos(turn)], size);
  };
}

/**
 * Adds what the model wears, and its neck, arms and legs, as skins around its bones. `neck`: the factor on the width of
 * the neck. Rows go upwards: height, half width and half depth, m.
 */
function addClothes(mesh: SkinnedMeshBytes, neck: number): void {
  const trunk = ["hips", "spine", "chest", "upperChest", "neck", "head"];
  const up = (rows: readonly Row[], colour: Colour) => addLoft(mesh, rows, [0, 0], trunk, colour);
  up(
    [
      [0.85, 0.1, 0.07],
      [0.87, 0.145, 0.1],
      [0.92, 0.148, 0.106],
      [0.99, 0.135, 0.1],
    ],
    kTrousers,
  );
  up(
    [
      [0.925, 0.13, 0.09],
      [0.93, 0.15, 0.109],
      [1.02, 0.133, 0.102],
      [1.13, 0.128, 0.097],
      [1.25, 0.146, 0.104],
      [1.34, 0.16, 0.102],
      [1.39, 0.157, 0.09],
      [1.42, 0.135, 0.078],
      [1.445, 0.085, 0.066],
      [1.458, 0.05, 0.05],
    ],
    kJumper,
  );
  up(
    [
      [1.435, 0.058, 0.058],
      [1.455, 0.062, 0.061],
      [1.472, 0.058, 0.057],
      [1.474, 0.05, 0.05],
    ],
    kCollar,
  );
  up(
    [
      [1.4, 0.052, 0.05],
      [1.47, 0.046 * neck, 0.048 * neck],
      [1.52, 0.045 * neck, 0.05 * neck],
      [1.53 + 0.04 * neck, 0.045 * neck, 0.05 * neck],
    ],
    kSkin,
  );
  for (const side of [1, -1]) {
    const name = (bone: string) => `${side > 0 ? "left" : "right"}${bone}`;
    addLimb(mesh, side, [name("Shoulder"), name("UpperArm"), name("LowerArm"), name("Hand")]);
    const leg = [name("Foot"), name("LowerLeg"), name("UpperLeg"), "hips"];
    const rows: Row[] = [
      [0.06, 0.05, 0.055],
      [0.1, 0.053, 0.06],
      [0.48, 0.063, 0.068],
      [0.75, 0.08, 0.086],
      [0.9, 0.075, 0.092],
    ];
    addLoft(mesh, rows, [0.08 * side, 0], leg, kTrousers);
    const foot = (along: number, around: number) => {
      const [x, y, z] = eggPoint(along, around, [0.08 * side, 0.035, 0.055], [0.047, 0.042, 0.12], 0);
      return [x, Math.max(y, 0), z] as const;
    };
    mesh.addSkin(16, 24, foot, only(name("Foot")), () => kShoes);
  }
}

/**
 * A ring of a skin: its place along the bones (a height, or the distance from the model's middle), and two half widths,
 * m.
 */
type Row = readonly [number, number, number];

/** An upright skin through ellipses, of bones that lie above each other. */
function addLoft(
  mesh: SkinnedMeshBytes,
  rows: readonly Row[],
  at: readonly [number, number],
  bones: string[],
  colour: Colour,
): void {
  const down = [...rows].reverse();
  const point = (along: number, around: number): Vector => {
    const [y, halfWidth, halfDepth] = rowAt(down, along);
    const turn = 2 * Math.PI * around;
    return [at[0] + halfWidth * Math.sin(turn), y, at[1] + halfDepth * Math.cos(turn)];
  };
  const joints = (along: number) =>
    blend(
      bones,
      bones.map((bone) => jointOf(bone)[1]),
      rowAt(down, along)[0],
    );
  mesh.addSkin(8 * down.length, 32, point, joints, () => colour);
}

/** A sleeve, and a hand with a thumb. */
function addLimb(mesh: SkinnedMeshBytes, side: number, bones: string[]): void {
  const y = jointOf(bones[0])[1];
  const rows: Row[] = [
    [0.07, 0.03, 0.045],
    [0.115, 0.047, 0.055],
    [0.17, 0.047, 0.05],
    [0.36, 0.041, 0.043],
    [0.56, 0.034, 0.035],
    [0.6, 0.036, 0.037],
    [0.603, 0.025, 0.026],
  ];
  const skin = (along: number, around: number): Vector => {
    const [x, halfHeight, halfDepth] = rowAt(rows, along);
    const turn = 2 * Math.PI * around * side;
    return [side * x, y - 0.012 + halfHeight * Math.sin(turn), halfDepth * Math.cos(turn)];
  };
  const joints = (along: number) =>
    blend(
      bones,
      bones.map((bone) => Math.abs(jointOf(bone)[0])),
      rowAt(rows, along)[0],
    );
  mesh.addSkin(40, 24, skin, joints, () => kJumper);
  const palm = (along: number, around: number) =>
    eggPoint(along, around, [0.665 * side, y - 0.003, 0.003], [0.082, 0.018, 0.036], 0);
  const thumb = (along: number, around: number) =>
    eggPoint(along, around, [0.64 * side, y - 0.006, 0.033], [0.036, 0.012, 0.012], -0.7 * side);
  for (const part of [palm, thumb]) mesh.addSkin(14, 20, part, only(bones[3]), () => kSkin);
}

/** The row at a share of the list, along a smooth curve (Catmull-Rom). */
function rowAt(rows: readonly Row[], along: number): Row {
  const at = along * (rows.length - 1);
  const n = Math.min(Math.floor(at), rows.length - 2);
  const t = at - n;
  const [a, b, c, d] = [rows[Math.max(n - 1, 0)], rows[n], rows[n + 1], rows[Math.min(n + 2, rows.length - 1)]];
  const curve = (i: number) =>
    b[i] +
    0.5 * t * (c[i] - a[i] + t * (2 * a[i] - 5 * b[i] + 4 * c[i] - d[i] + t * (3 * (b[i] - c[i]) + d[i] - a[i])));
  return [curve(0), curve(1), curve(2)];
}

/**
 * A point of an ellipsoid about `at` with these radii, which is turned by `yaw` about +Y. `along` and `around` as in
 * `headPoint`.
 */
function eggPoint(along: number, around: number, at: Vector, radii: Vector, yaw: number): Vector {
  const polar = Math.PI * Math.min(Math.max(along, 0.004), 0.996);
  const turn = 2 * Math.PI * around;
  const [x, z] = [radii[0] * Math.sin(polar) * Math.sin(turn), radii[2] * Math.sin(polar) * Math.cos(turn)];
  const [sin, cos] = [Math.sin(yaw), Math.cos(yaw)];
  return [at[0] + cos * x + sin * z, at[1] + radii[1] * Math.cos(polar), at[2] + cos * z - sin * x];
}

/** The joints of skin that moves with one bone alone. */
function only(bone: string): () => Joints {
  const joint = boneIndex(bone);
  return () => ({ first: joint, second: joint, firstShare: 1 });
}

/** Two bones of a chain share the skin within this distance of the joint between them. */
const kBlendM = 0.05;

/** The bones at a place along a chain: each begins at its joint, and neighbours share the skin near it. */
function blend(bones: readonly string[], starts: readonly number[], at: number): Joints {
  let n = 0;
  while (n + 1 < bones.length && at > starts[n + 1] - kBlendM) ++n;
  const share = n === 0 ? 1 : Math.min((at - starts[n] + kBlendM) / (2 * kBlendM), 1);
  return { first: boneIndex(bones[n]), second: boneIndex(bones[Math.max(n - 1, 0)]), firstShare: share };
}

function mix(a: Colour, b: Colour, share: number): Colour {
  return [0, 1, 2].map((n) => a[n] + share * (b[n] - a[n])) as unknown as Colour;
}

function vrmFile(meshes: readonly SkinnedMeshBytes[], version: 0 | 1): Uint8Array<ArrayBuffer> {
  const glb = new GlbBytes();
  // Everything is made to look along +Z. For version 0 it is turned by half a turn about +Y.
  const turn = version === 0 ? -1 : 1;
  const turned = ([x, y, z]: Vector) => [turn * x, y, turn * z];
  const primitives = meshes.map((mesh, material) => ({ ...mesh.write(glb, turn), material }));
  const inverseBind = kBones.flatMap(({ name }) => {
    const [x, y, z] = turned(jointOf(name));
    // This is a translation, column by column: bones at rest have the axes of the model.
    return [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -x, -y, -z, 1];
  });
  const inverseBindMatrices = glb.addArray(new Float32Array(inverseBind), 16, "MAT4", 5126);
  return glb.file({
    asset: { version: "2.0", generator: "hairnet" },
    extensionsUsed: [version === 0 ? "VRM" : "VRMC_vrm"],
    scene: 0,
    scenes: [{ nodes: [boneIndex("hips"), ...meshes.map((_, n) => kBones.length + n)] }],
    nodes: [
      ...kBones.map((bone) => {
        const children = kBones.flatMap((other, n) => (other.parent === bone.name ? [n] : []));
        return { name: bone.name, translation: turned(bone.at), ...(children.length > 0 ? { children } : {}) };
      }),
      ...meshes.map(({ name }, mesh) => ({ name, mesh, skin: 0 })),
    ],
    meshes: meshes.map(({ name }, n) => ({ name, primitives: [primitives[n]] })),
    skins: [{ joints: kBones.map((_, n) => n), inverseBindMatrices, skeleton: boneIndex("hips") }],
    materials: meshes.map(({ name, roughness }) => ({
      name,
      pbrMetallicRoughness: { metallicFactor: 0, roughnessFactor: roughness },
    })),
    extensions: version === 0 ? { VRM: oldVrm() } : { VRMC_vrm: newVrm() },
  });
}

function newVrm(): object {
  return {
    specVersion: "1.0",
    meta: { name: "Hairnet", authors: ["Hairnet"], licenseUrl: "https://vrm.dev/licenses/1.0/" },
    humanoid: { humanBones: Object.fromEntries(kBones.map(({ name }, node) => [name, { node }])) },
  };
}

function oldVrm(): object {
  return {
    specVersion: "0.0",
    meta: { title: "Hairnet", author: "Hairnet", licenseName: "CC0" },
    humanoid: { humanBones: kBones.map(({ name }, node) => ({ bone: name, node, useDefaultValues: true })) },
    firstPerson: {},
    blendShapeMaster: { blendShapeGroups: [] },
    secondaryAnimation: { boneGroups: [], colliderGroups: [] },
    materialProperties: [],
  };
}
