/**
 * A plain humanoid as the bytes of a VRM 1.0 file: boxes for a body, an egg for a head, and a cap of "hair" with a tail
 * on a spring bone. Code makes it, so it needs no licence of another person.
 */
export function makeMinimalVrm(): ArrayBuffer {
  const body = new MeshBytes();
  const hair = new MeshBytes();
  for (const bone of kBones) {
    if (bone.box) body.addBox(placeOf(bone.name), bone.box, indexOf(bone.name));
  }
  const head = placeOf("head");
  body.addEgg([head[0], head[1] + 0.085, head[2] + 0.02], [0.085, 0.125, 0.105], indexOf("head"));
  body.addBox(
    [head[0], head[1] + 0.06, head[2] + 0.12],
    { middle: [0, 0, 0], half: [0.012, 0.02, 0.015] },
    indexOf("head"),
  );
  hair.addEgg([head[0], head[1] + 0.11, head[2] + 0.005], [0.1, 0.125, 0.118], indexOf("head"));
  const tail = placeOf("hair_tail");
  hair.addBox(tail, { middle: [0, -0.15, 0], half: [0.04, 0.15, 0.025] }, indexOf("hair_tail"));
  return glb([body, hair]);
}

type Vector = readonly [number, number, number];
interface Box {
  readonly middle: Vector;
  readonly half: Vector;
}
interface BoneSpec {
  readonly name: string;
  readonly parent: string | null;
  /** from the parent */
  readonly at: Vector;
  /** the box that it carries */
  readonly box?: Box;
  /** its name in the VRM, if it is a human bone */
  readonly human?: boolean;
}

const limb = (side: 1 | -1, prefix: string): BoneSpec[] => [
  { name: `${prefix}Shoulder`, parent: "upperChest", at: [0.03 * side, 0.1, 0], human: true },
  {
    name: `${prefix}UpperArm`,
    parent: `${prefix}Shoulder`,
    at: [0.1 * side, 0, 0],
    box: { middle: [0.11 * side, 0, 0], half: [0.12, 0.035, 0.035] },
    human: true,
  },
  {
    name: `${prefix}LowerArm`,
    parent: `${prefix}UpperArm`,
    at: [0.24 * side, 0, 0],
    box: { middle: [0.11 * side, 0, 0], half: [0.11, 0.03, 0.03] },
    human: true,
  },
  {
    name: `${prefix}Hand`,
    parent: `${prefix}LowerArm`,
    at: [0.23 * side, 0, 0],
    box: { middle: [0.06 * side, 0, 0], half: [0.06, 0.015, 0.035] },
    human: true,
  },
  {
    name: `${prefix}UpperLeg`,
    parent: "hips",
    at: [0.09 * side, -0.05, 0],
    box: { middle: [0, -0.2, 0], half: [0.065, 0.2, 0.07] },
    human: true,
  },
  {
    name: `${prefix}LowerLeg`,
    parent: `${prefix}UpperLeg`,
    at: [0, -0.42, 0],
    box: { middle: [0, -0.2, 0], half: [0.05, 0.2, 0.055] },
    human: true,
  },
  {
    name: `${prefix}Foot`,
    parent: `${prefix}LowerLeg`,
    at: [0, -0.42, 0],
    box: { middle: [0, -0.03, 0.05], half: [0.045, 0.03, 0.11] },
    human: true,
  },
];

const kBones: readonly BoneSpec[] = [
  { name: "hips", parent: null, at: [0, 0.95, 0], box: { middle: [0, 0, 0], half: [0.14, 0.09, 0.09] }, human: true },
  {
    name: "spine",
    parent: "hips",
    at: [0, 0.1, 0],
    box: { middle: [0, 0.05, 0], half: [0.12, 0.07, 0.08] },
    human: true,
  },
  {
    name: "chest",
    parent: "spine",
    at: [0, 0.12, 0],
    box: { middle: [0, 0.06, 0], half: [0.13, 0.08, 0.085] },
    human: true,
  },
  {
    name: "upperChest",
    parent: "chest",
    at: [0, 0.13, 0],
    box: { middle: [0, 0.06, -0.01], half: [0.15, 0.07, 0.085] },
    human: true,
  },
  {
    name: "neck",
    parent: "upperChest",
    at: [0, 0.14, -0.01],
    box: { middle: [0, 0.04, 0], half: [0.045, 0.06, 0.045] },
    human: true,
  },
  { name: "head", parent: "neck", at: [0, 0.09, 0.01], human: true },
  { name: "hair_tail", parent: "head", at: [0, 0.1, -0.11] },
  ...limb(1, "left"),
  ...limb(-1, "right"),
];

function indexOf(bone: string): number {
  return kBones.findIndex((other) => other.name === bone);
}

function placeOf(bone: string): Vector {
  const spec = kBones[indexOf(bone)];
  const parent = spec.parent ? placeOf(spec.parent) : [0, 0, 0];
  return [parent[0] + spec.at[0], parent[1] + spec.at[1], parent[2] + spec.at[2]];
}

/** A skinned mesh; each part belongs to one bone. */
class MeshBytes {
  readonly positions: number[] = [];
  readonly normals: number[] = [];
  readonly joints: number[] = [];
  readonly weights: number[] = [];
  readonly indices: number[] = [];

  addBox(at: Vector, { middle, half }: Box, bone: number): void {
    for (let axis = 0; axis < 3; ++axis)
      for (const side of [-1, 1]) {
        const first = this.positions.length / 3;
        for (const [u, v] of [
          [-1, -1],
          [1, -1],
          [1, 1],
          [-1, 1],
        ]) {
          const place = [0, 0, 0];
          const normal: [number, number, number] = [0, 0, 0];
          place[axis] = side;
          place[(axis + 1) % 3] = u;
          place[(axis + 2) % 3] = v;
          normal[axis] = side;
          this.#add(
            [0, 1, 2].map((a) => at[a] + middle[a] + half[a] * place[a]),
            normal,
            bone,
          );
        }
        const [b, d] = side > 0 ? [1, 3] : [3, 1];
        this.indices.push(first, first + b, first + 2, first, first + 2, first + d);
      }
  }

  addEgg(middle: Vector, radii: Vector, bone: number): void {
    const rings = 20;
    const turns = 20;
    const first = this.positions.length / 3;
    for (let i = 0; i <= rings; ++i)
      for (let j = 0; j <= turns; ++j) {
        const polar = (Math.PI * i) / rings;
        const turn = (2 * Math.PI * j) / turns;
        const n = [Math.sin(polar) * Math.sin(turn), Math.cos(polar), Math.sin(polar) * Math.cos(turn)];
        const slope = n.map((x, axis) => x / radii[axis]);
        const length = Math.hypot(...slope);
        this.#add(
          n.map((x, axis) => middle[axis] + radii[axis] * x),
          slope.map((x) => x / length),
          bone,
        );
        if (i === rings || j === turns) continue;
        const a = first + i * (turns + 1) + j;
        const b = a + turns + 1;
        this.indices.push(a, b, a + 1, a + 1, b, b + 1);
      }
  }

  #add(position: readonly number[], normal: readonly number[], bone: number): void {
    this.positions.push(...position);
    this.normals.push(...normal);
    this.joints.push(bone, 0, 0, 0);
    this.weights.push(1, 0, 0, 0);
  }
}

const kFloat = 5126;
const kShort = 5123;

/** Body, then hair. */
function glb(meshes: readonly MeshBytes[]): ArrayBuffer {
  const chunks: Uint8Array[] = [];
  const bufferViews: object[] = [];
  const accessors: object[] = [];
  let bytes = 0;
  const addAccessor = (values: number[], size: number, type: string, isShort: boolean): number => {
    const array = isShort ? new Uint16Array(values) : new Float32Array(values);
    const chunk = new Uint8Array(4 * Math.ceil(array.byteLength / 4));
    chunk.set(new Uint8Array(array.buffer));
    bufferViews.push({ buffer: 0, byteOffset: bytes, byteLength: array.byteLength });
    const column = (n: number) => values.filter((_, i) => i % size === n);
    const bounds = {
      min: [0, 1, 2].map((n) => Math.min(...column(n))),
      max: [0, 1, 2].map((n) => Math.max(...column(n))),
    };
    accessors.push({
      bufferView: bufferViews.length - 1,
      componentType: isShort ? kShort : kFloat,
      count: values.length / size,
      type,
      ...(type === "VEC3" ? bounds : {}),
    });
    chunks.push(chunk);
    bytes += chunk.length;
    return accessors.length - 1;
  };
  const primitives = meshes.map((mesh, material) => ({
    attributes: {
      POSITION: addAccessor(mesh.positions, 3, "VEC3", false),
      NORMAL: addAccessor(mesh.normals, 3, "VEC3", false),
      JOINTS_0: addAccessor(mesh.joints, 4, "VEC4", true),
      WEIGHTS_0: addAccessor(mesh.weights, 4, "VEC4", false),
    },
    indices: addAccessor(mesh.indices, 1, "SCALAR", true),
    material,
  }));
  const inverseBind = kBones.flatMap(({ name }) => {
    const [x, y, z] = placeOf(name);
    return [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -x, -y, -z, 1];
  });
  const inverseBindMatrices = addAccessor(inverseBind, 16, "MAT4", false);
  const joints = kBones.map((_, n) => n);
  const bodyNode = kBones.length;
  const json = {
    asset: { version: "2.0", generator: "hairnet minimal model" },
    extensionsUsed: ["VRMC_vrm", "VRMC_springBone"],
    scene: 0,
    scenes: [{ nodes: [indexOf("hips"), bodyNode, bodyNode + 1] }],
    nodes: [
      ...kBones
        .map((bone) => ({
          name: bone.name,
          translation: bone.at,
          children: kBones.flatMap((other, n) => (other.parent === bone.name ? [n] : [])),
        }))
        .map((node) => (node.children.length > 0 ? node : { ...node, children: undefined })),
      { name: "Body", mesh: 0, skin: 0 },
      { name: "Hair", mesh: 1, skin: 0 },
    ],
    meshes: [
      { name: "Body", primitives: [primitives[0]] },
      { name: "Hair", primitives: [primitives[1]] },
    ],
    skins: [{ joints, inverseBindMatrices, skeleton: indexOf("hips") }],
    materials: [
      {
        name: "Skin",
        pbrMetallicRoughness: { baseColorFactor: [0.75, 0.55, 0.45, 1], metallicFactor: 0, roughnessFactor: 0.8 },
      },
      {
        name: "HairCap",
        pbrMetallicRoughness: { baseColorFactor: [0.2, 0.3, 0.7, 1], metallicFactor: 0, roughnessFactor: 0.6 },
      },
    ],
    accessors,
    bufferViews,
    buffers: [{ byteLength: bytes }],
    extensions: {
      VRMC_vrm: {
        specVersion: "1.0",
        meta: { name: "Minimal", authors: ["Hairnet"], licenseUrl: "https://vrm.dev/licenses/1.0/" },
        humanoid: {
          humanBones: Object.fromEntries(kBones.flatMap((bone, node) => (bone.human ? [[bone.name, { node }]] : []))),
        },
      },
      VRMC_springBone: {
        specVersion: "1.0",
        springs: [{ name: "tail", joints: [{ node: indexOf("hair_tail"), stiffness: 1, hitRadius: 0.02 }] }],
      },
    },
  };
  return assemble(JSON.stringify(json), chunks, bytes);
}

function assemble(json: string, chunks: readonly Uint8Array[], binaryBytes: number): ArrayBuffer {
  const text = new TextEncoder().encode(json);
  const textBytes = 4 * Math.ceil(text.length / 4);
  const out = new Uint8Array(12 + 8 + textBytes + 8 + binaryBytes);
  const view = new DataView(out.buffer);
  const header = [0x46546c67, 2, out.length, textBytes, 0x4e4f534a];
  for (const [n, word] of header.entries()) view.setUint32(4 * n, word, true);
  out.fill(0x20, 20, 20 + textBytes);
  out.set(text, 20);
  view.setUint32(20 + textBytes, binaryBytes, true);
  view.setUint32(24 + textBytes, 0x004e4942, true);
  let at = 28 + textBytes;
  for (const chunk of chunks) {
    out.set(chunk, at);
    at += chunk.length;
  }
  return out.buffer;
}
