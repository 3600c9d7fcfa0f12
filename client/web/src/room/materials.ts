import { checkOptions } from "../hair/checkOptions";

/** Factors, 0.01 to 100 each, on the material of the groom; and gel, 0 (none) to 10 000 per square second. */
export interface MaterialScale {
  readonly stiffness: number;
  readonly damping: number;
  readonly density: number;
  readonly etherDamping: number;
  readonly airDrag: number;
  readonly gelPerS2: number;
}

const normal: MaterialScale = { stiffness: 1, damping: 1, density: 1, etherDamping: 1, airDrag: 1, gelPerS2: 0 };

/** Materials of hair, for `OwnCharacter.setMaterial`. All are relative to what the hairstyle was made with. */
export const materials = {
  /** As the hairstyle was made. */
  normal,
  /** Four times the stiffness: keeps its shape and swings faster. Damping grows too, so that it does not ring. */
  stiff: { ...normal, stiffness: 4, damping: 2 },
  /** A third of the stiffness, and little damping: swings far and slowly. */
  soft: { ...normal, stiffness: 0.3, damping: 0.6 },
  /**
   * Water doubles the mass and makes strands stick: heavy, slow to start and quick to rest; wind finds less surface.
   */
  wet: { ...normal, stiffness: 0.7, damping: 3, density: 2, etherDamping: 1.5, airDrag: 0.4 },
  /**
   * Gel binds every strand to its place on the head (the ether's stiffness): hardly moves, and springs back at once.
   */
  gel: { ...normal, damping: 2, gelPerS2: 800 },
  /** Water carries the weight and resists each motion: floats after the head, and goes with the "wind" as current. */
  underwater: { ...normal, stiffness: 0.4, damping: 2, density: 0.4, etherDamping: 6, airDrag: 20 },
} as const satisfies Record<string, MaterialScale>;

/** The material with these values, and the normal ones for the rest. */
export function materialOf(scale: Partial<MaterialScale>): MaterialScale {
  checkOptions(scale, normal, "setMaterial");
  return { ...normal, ...scale };
}

/** The bytes of a hairnet_material (client/hairnet.h). */
export function materialBytes({
  stiffness,
  damping,
  density,
  etherDamping,
  airDrag,
  gelPerS2,
}: MaterialScale): Uint8Array {
  return new Uint8Array(Float32Array.of(stiffness, damping, density, etherDamping, airDrag, gelPerS2).buffer);
}
