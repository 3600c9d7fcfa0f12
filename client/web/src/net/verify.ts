/** One field of a table: its slot in the vtable, and what lies there. Generated from the schema. */
export interface FieldLayout {
  readonly slot: number;
  readonly name: string;
  readonly required?: boolean;
  readonly kind: "inline" | "string" | "table" | "vector" | "union";
  readonly bytes?: number;
  readonly align?: number;
  readonly table?: string;
  readonly of?: ElementLayout;
  readonly tables?: Readonly<Record<number, string>>;
}

export interface ElementLayout {
  readonly kind: "inline" | "string" | "table";
  readonly bytes?: number;
  readonly align?: number;
  readonly table?: string;
}

export type TableLayout = readonly FieldLayout[];
