// What the program and the page say to each other: docs/studio-protocol.md. Points are RAS mm.

export type Point = [number, number, number];
export type Side = 'inside' | 'outside';

export interface Click { point: Point; side: Side }

export interface Measures {
  volume_ml?: number; volume_deviation_ml?: number | null; area_cm2?: number;
  triangles?: number; vertices?: number; components?: number;
  passed?: boolean; verification?: string; share_without_edge?: number | null; next_click?: Point | null;
}

export interface Verdict { trust: string; words: string; place?: Point | null }

export interface Candidate { number: number; words: string; score?: number; volume_ml?: number; chosen?: boolean }

export type OptionValue = number | string | boolean | string[];
export type OptionValues = Record<string, OptionValue>;

export interface StudioObject {
  id: number; name: string; colour: string;
  clicks: Click[]; options: OptionValues;
  outcome?: string | null; message?: string | null;
  outdated: boolean; has_surface: boolean; surface: number;
  measures: Measures | null; verdict: Verdict | null;
  candidates: Candidate[]; notes: string[];
  can_undo: boolean; can_redo: boolean; undo_words?: string | null; redo_words?: string | null;
}

export interface Series { id: string | number; words: string }
export interface ListedFile { path: string; kind: string; words?: string; series?: Series[] | string | number | null }

export interface Volume {
  revision: number; path: string; kept_in?: string; size: Point; spacing_mm: Point; index_to_world: number[][];
  minimum: number; maximum: number; window: [number, number] | null; is_ct: boolean; coarser_by: Point; notes: string[];
}

export interface Job {
  id: number; object?: number | null; what: string; stage?: string; step?: number; seconds?: number; frame?: number;
  share?: number;
}

export interface ProgramError { id: number; text: string }

export interface State {
  revision: number; program: { name: string; version: string }; folder: string;
  files: ListedFile[]; volume: Volume | null; job: Job | null; objects: StudioObject[]; removed?: string | null; error: ProgramError | null;
}

export interface Option {
  key: string; label: string; group: string; unit: string; type: 'number' | 'integer' | 'boolean' | 'choice' | 'energies';
  minimum: number; help: string; standard: OptionValue | null; choices: string[];
}
export type ParameterRange = { text: string; values: number[] }
  | { text: string; lowest: number | null; highest: number | null; excludes_lowest: boolean };
export interface EnergyParameter { key: string; unit: string; help: string; range: ParameterRange; standard: string }
export interface EnergyKind { name: string; formula: string; help: string; parameters: EnergyParameter[] }
export interface OptionTable {
  options: Option[]; energies: EnergyKind[]; presets: { name: string; words: string }[];
  export: Partial<Record<ExportKind, string[]>>;
}
export type ExportKind = 'surface' | 'labels' | 'measures' | 'picture' | 'report' | 'recipe';
export interface ExportRequest {
  what: ExportKind; object: number; format: string; space: 'lps' | 'ras'; name: string; overwrite: boolean;
}

export type Action = { action: string; object?: number; [key: string]: unknown };
