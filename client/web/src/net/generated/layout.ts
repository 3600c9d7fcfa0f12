import type { TableLayout } from "../verify";

export const layouts: Record<string, TableLayout> = {
 "AddCharacter": [
  {
   "slot": 4,
   "name": "groom",
   "required": true,
   "kind": "inline",
   "bytes": 32,
   "align": 8
  },
  {
   "slot": 6,
   "name": "character",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  },
  {
   "slot": 8,
   "name": "level",
   "kind": "inline",
   "bytes": 1,
   "align": 1
  },
  {
   "slot": 10,
   "name": "state",
   "kind": "table",
   "table": "HairState"
  },
  {
   "slot": 12,
   "name": "tag",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 1,
    "align": 1
   }
  },
  {
   "slot": 14,
   "name": "appearance",
   "kind": "inline",
   "bytes": 10,
   "align": 1
  }
 ],
 "CharacterAdded": [
  {
   "slot": 4,
   "name": "groom",
   "required": true,
   "kind": "inline",
   "bytes": 32,
   "align": 8
  },
  {
   "slot": 6,
   "name": "character",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  },
  {
   "slot": 8,
   "name": "level",
   "kind": "inline",
   "bytes": 1,
   "align": 1
  },
  {
   "slot": 10,
   "name": "member",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  },
  {
   "slot": 12,
   "name": "generation",
   "kind": "inline",
   "bytes": 1,
   "align": 1
  }
 ],
 "CharacterRemoved": [
  {
   "slot": 4,
   "name": "character",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  }
 ],
 "Envelope": [
  {
   "slot": 4,
   "name": "clock_ns",
   "kind": "inline",
   "bytes": 8,
   "align": 8
  },
  {
   "slot": 6,
   "name": "body_type",
   "kind": "inline",
   "bytes": 1,
   "align": 1
  },
  {
   "slot": 8,
   "name": "body",
   "required": true,
   "kind": "union",
   "tables": {
    "1": "Hello",
    "2": "GroomOffer",
    "3": "GroomChunk",
    "4": "AddCharacter",
    "5": "SetLevel",
    "6": "RemoveCharacter",
    "7": "PoseBatch",
    "8": "Welcome",
    "9": "GroomNeed",
    "10": "GroomStatus",
    "11": "CharacterAdded",
    "12": "CharacterRemoved",
    "13": "FrameBatch",
    "14": "Error",
    "15": "Goodbye",
    "16": "SetMaterial",
    "17": "SetWind",
    "18": "Observe",
    "19": "ReportImportance",
    "20": "GroomRequest",
    "21": "GroomData",
    "22": "MemberJoined",
    "23": "MemberLeft",
    "24": "Moderate",
    "25": "SetAppearance",
    "26": "MemberChanged",
    "27": "RoomWind",
    "28": "GroomBasis",
    "29": "GroomLearnt",
    "30": "EvaluateLearnt",
    "31": "Redirect"
   }
  }
 ],
 "Error": [
  {
   "slot": 4,
   "name": "groom",
   "kind": "inline",
   "bytes": 32,
   "align": 8
  },
  {
   "slot": 6,
   "name": "detail",
   "kind": "string"
  },
  {
   "slot": 8,
   "name": "character",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  },
  {
   "slot": 10,
   "name": "reason",
   "kind": "inline",
   "bytes": 1,
   "align": 1
  }
 ],
 "EvaluateLearnt": [
  {
   "slot": 4,
   "name": "groom",
   "required": true,
   "kind": "inline",
   "bytes": 32,
   "align": 8
  },
  {
   "slot": 6,
   "name": "learnt",
   "required": true,
   "kind": "inline",
   "bytes": 32,
   "align": 8
  }
 ],
 "FrameBatch": [
  {
   "slot": 4,
   "name": "tick",
   "kind": "inline",
   "bytes": 8,
   "align": 8
  },
  {
   "slot": 6,
   "name": "sample_time_ns",
   "kind": "inline",
   "bytes": 8,
   "align": 8
  },
  {
   "slot": 8,
   "name": "frames",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 1,
    "align": 1
   }
  },
  {
   "slot": 10,
   "name": "generations",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 1,
    "align": 1
   }
  }
 ],
 "Goodbye": [
  {
   "slot": 4,
   "name": "detail",
   "kind": "string"
  },
  {
   "slot": 6,
   "name": "reason",
   "kind": "inline",
   "bytes": 1,
   "align": 1
  }
 ],
 "GroomBasis": [
  {
   "slot": 4,
   "name": "groom",
   "required": true,
   "kind": "inline",
   "bytes": 32,
   "align": 8
  },
  {
   "slot": 6,
   "name": "basis",
   "required": true,
   "kind": "inline",
   "bytes": 32,
   "align": 8
  }
 ],
 "GroomChunk": [
  {
   "slot": 4,
   "name": "hash",
   "required": true,
   "kind": "inline",
   "bytes": 32,
   "align": 8
  },
  {
   "slot": 6,
   "name": "offset",
   "kind": "inline",
   "bytes": 8,
   "align": 8
  },
  {
   "slot": 8,
   "name": "bytes",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 1,
    "align": 1
   }
  }
 ],
 "GroomData": [
  {
   "slot": 4,
   "name": "hash",
   "required": true,
   "kind": "inline",
   "bytes": 32,
   "align": 8
  },
  {
   "slot": 6,
   "name": "byte_count",
   "kind": "inline",
   "bytes": 8,
   "align": 8
  },
  {
   "slot": 8,
   "name": "offset",
   "kind": "inline",
   "bytes": 8,
   "align": 8
  },
  {
   "slot": 10,
   "name": "bytes",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 1,
    "align": 1
   }
  }
 ],
 "GroomLearnt": [
  {
   "slot": 4,
   "name": "groom",
   "required": true,
   "kind": "inline",
   "bytes": 32,
   "align": 8
  },
  {
   "slot": 6,
   "name": "learnt",
   "required": true,
   "kind": "inline",
   "bytes": 32,
   "align": 8
  }
 ],
 "GroomNeed": [
  {
   "slot": 4,
   "name": "hash",
   "required": true,
   "kind": "inline",
   "bytes": 32,
   "align": 8
  },
  {
   "slot": 6,
   "name": "offset",
   "kind": "inline",
   "bytes": 8,
   "align": 8
  }
 ],
 "GroomOffer": [
  {
   "slot": 4,
   "name": "hash",
   "required": true,
   "kind": "inline",
   "bytes": 32,
   "align": 8
  },
  {
   "slot": 6,
   "name": "byte_count",
   "kind": "inline",
   "bytes": 8,
   "align": 8
  }
 ],
 "GroomRequest": [
  {
   "slot": 4,
   "name": "hash",
   "required": true,
   "kind": "inline",
   "bytes": 32,
   "align": 8
  },
  {
   "slot": 6,
   "name": "offset",
   "kind": "inline",
   "bytes": 8,
   "align": 8
  }
 ],
 "GroomStatus": [
  {
   "slot": 4,
   "name": "hash",
   "required": true,
   "kind": "inline",
   "bytes": 32,
   "align": 8
  },
  {
   "slot": 6,
   "name": "state",
   "kind": "inline",
   "bytes": 1,
   "align": 1
  }
 ],
 "HairState": [
  {
   "slot": 4,
   "name": "displacements",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 2,
    "align": 2
   }
  },
  {
   "slot": 6,
   "name": "velocities",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 2,
    "align": 2
   }
  },
  {
   "slot": 8,
   "name": "step_m",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  }
 ],
 "Hello": [
  {
   "slot": 4,
   "name": "protocol_version",
   "kind": "inline",
   "bytes": 2,
   "align": 2
  },
  {
   "slot": 6,
   "name": "client_name",
   "kind": "string"
  },
  {
   "slot": 8,
   "name": "room",
   "kind": "string"
  },
  {
   "slot": 10,
   "name": "token",
   "kind": "string"
  },
  {
   "slot": 12,
   "name": "role",
   "kind": "inline",
   "bytes": 1,
   "align": 1
  },
  {
   "slot": 14,
   "name": "session",
   "kind": "inline",
   "bytes": 8,
   "align": 8
  },
  {
   "slot": 16,
   "name": "secret",
   "kind": "inline",
   "bytes": 16,
   "align": 8
  },
  {
   "slot": 18,
   "name": "message_max",
   "kind": "inline",
   "bytes": 1,
   "align": 1
  },
  {
   "slot": 20,
   "name": "redirects",
   "kind": "inline",
   "bytes": 1,
   "align": 1
  },
  {
   "slot": 22,
   "name": "datagram_layout",
   "kind": "inline",
   "bytes": 1,
   "align": 1
  },
  {
   "slot": 24,
   "name": "trace",
   "kind": "inline",
   "bytes": 8,
   "align": 8
  },
  {
   "slot": 26,
   "name": "signs_of_life",
   "kind": "inline",
   "bytes": 1,
   "align": 1
  }
 ],
 "MemberChanged": [
  {
   "slot": 4,
   "name": "tag",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 1,
    "align": 1
   }
  },
  {
   "slot": 6,
   "name": "appearance",
   "kind": "inline",
   "bytes": 10,
   "align": 1
  },
  {
   "slot": 8,
   "name": "member",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  }
 ],
 "MemberJoined": [
  {
   "slot": 4,
   "name": "groom",
   "required": true,
   "kind": "inline",
   "bytes": 32,
   "align": 8
  },
  {
   "slot": 6,
   "name": "session",
   "kind": "inline",
   "bytes": 8,
   "align": 8
  },
  {
   "slot": 8,
   "name": "character",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  },
  {
   "slot": 10,
   "name": "member",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  },
  {
   "slot": 12,
   "name": "tag",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 1,
    "align": 1
   }
  },
  {
   "slot": 14,
   "name": "appearance",
   "kind": "inline",
   "bytes": 10,
   "align": 1
  },
  {
   "slot": 16,
   "name": "generation",
   "kind": "inline",
   "bytes": 1,
   "align": 1
  }
 ],
 "MemberLeft": [
  {
   "slot": 4,
   "name": "member",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  }
 ],
 "Moderate": [
  {
   "slot": 4,
   "name": "subject",
   "kind": "string"
  },
  {
   "slot": 6,
   "name": "reason",
   "kind": "string"
  },
  {
   "slot": 8,
   "name": "session",
   "kind": "inline",
   "bytes": 8,
   "align": 8
  },
  {
   "slot": 10,
   "name": "seconds",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  },
  {
   "slot": 12,
   "name": "action",
   "kind": "inline",
   "bytes": 1,
   "align": 1
  }
 ],
 "Observe": [
  {
   "slot": 4,
   "name": "members",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 4,
    "align": 4
   }
  },
  {
   "slot": 6,
   "name": "from",
   "kind": "inline",
   "bytes": 12,
   "align": 4
  },
  {
   "slot": 8,
   "name": "count",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  },
  {
   "slot": 10,
   "name": "radius_m",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  },
  {
   "slot": 12,
   "name": "stride",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  },
  {
   "slot": 14,
   "name": "mode",
   "kind": "inline",
   "bytes": 1,
   "align": 1
  },
  {
   "slot": 16,
   "name": "error_m",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  },
  {
   "slot": 18,
   "name": "bytes_per_s",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  }
 ],
 "PackedTable": [
  {
   "slot": 4,
   "name": "unpacked_bytes",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  },
  {
   "slot": 6,
   "name": "stream",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 1,
    "align": 1
   }
  }
 ],
 "PoseBatch": [
  {
   "slot": 4,
   "name": "poses",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 160,
    "align": 8
   }
  },
  {
   "slot": 6,
   "name": "earlier",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 72,
    "align": 4
   }
  }
 ],
 "Redirect": [
  {
   "slot": 4,
   "name": "to",
   "kind": "table",
   "table": "ServerAt"
  }
 ],
 "RemoveCharacter": [
  {
   "slot": 4,
   "name": "character",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  }
 ],
 "ReportImportance": [
  {
   "slot": 4,
   "name": "members",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 12,
    "align": 4
   }
  }
 ],
 "RoomWind": [
  {
   "slot": 4,
   "name": "wind",
   "required": true,
   "kind": "inline",
   "bytes": 64,
   "align": 8
  },
  {
   "slot": 6,
   "name": "session",
   "kind": "inline",
   "bytes": 8,
   "align": 8
  },
  {
   "slot": 8,
   "name": "carried",
   "kind": "inline",
   "bytes": 1,
   "align": 1
  }
 ],
 "ServerAt": [
  {
   "slot": 4,
   "name": "host",
   "kind": "string"
  },
  {
   "slot": 6,
   "name": "port",
   "kind": "inline",
   "bytes": 2,
   "align": 2
  }
 ],
 "SetAppearance": [
  {
   "slot": 4,
   "name": "tag",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 1,
    "align": 1
   }
  },
  {
   "slot": 6,
   "name": "appearance",
   "kind": "inline",
   "bytes": 10,
   "align": 1
  },
  {
   "slot": 8,
   "name": "character",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  }
 ],
 "SetLevel": [
  {
   "slot": 4,
   "name": "character",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  },
  {
   "slot": 6,
   "name": "level",
   "kind": "inline",
   "bytes": 1,
   "align": 1
  }
 ],
 "SetMaterial": [
  {
   "slot": 4,
   "name": "scale",
   "required": true,
   "kind": "inline",
   "bytes": 24,
   "align": 4
  },
  {
   "slot": 6,
   "name": "character",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  }
 ],
 "SetWind": [
  {
   "slot": 4,
   "name": "wind",
   "required": true,
   "kind": "inline",
   "bytes": 64,
   "align": 8
  },
  {
   "slot": 6,
   "name": "carried",
   "kind": "inline",
   "bytes": 1,
   "align": 1
  }
 ],
 "Welcome": [
  {
   "slot": 4,
   "name": "session",
   "kind": "inline",
   "bytes": 8,
   "align": 8
  },
  {
   "slot": 6,
   "name": "tick",
   "kind": "inline",
   "bytes": 8,
   "align": 8
  },
  {
   "slot": 8,
   "name": "groom_bytes_max",
   "kind": "inline",
   "bytes": 8,
   "align": 8
  },
  {
   "slot": 10,
   "name": "tick_rate_hz",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  },
  {
   "slot": 12,
   "name": "character_count_max",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  },
  {
   "slot": 14,
   "name": "protocol_version",
   "kind": "inline",
   "bytes": 2,
   "align": 2
  },
  {
   "slot": 16,
   "name": "room",
   "kind": "string"
  },
  {
   "slot": 18,
   "name": "secret",
   "kind": "inline",
   "bytes": 16,
   "align": 8
  },
  {
   "slot": 20,
   "name": "resumed",
   "kind": "inline",
   "bytes": 1,
   "align": 1
  },
  {
   "slot": 22,
   "name": "resume_grace_s",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  },
  {
   "slot": 24,
   "name": "pose_delay_ns",
   "kind": "inline",
   "bytes": 8,
   "align": 8
  },
  {
   "slot": 26,
   "name": "may_set_wind",
   "kind": "inline",
   "bytes": 1,
   "align": 1
  },
  {
   "slot": 28,
   "name": "others",
   "kind": "vector",
   "of": {
    "kind": "table",
    "table": "ServerAt"
   }
  },
  {
   "slot": 30,
   "name": "signs_of_life",
   "kind": "inline",
   "bytes": 1,
   "align": 1
  }
 ],
 "Groom": [
  {
   "slot": 4,
   "name": "version",
   "kind": "inline",
   "bytes": 2,
   "align": 2
  },
  {
   "slot": 6,
   "name": "fitted_from_roots",
   "kind": "inline",
   "bytes": 1,
   "align": 1
  },
  {
   "slot": 8,
   "name": "name",
   "required": true,
   "kind": "string"
  },
  {
   "slot": 10,
   "name": "group_names",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "string"
   }
  },
  {
   "slot": 12,
   "name": "strands",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 16,
    "align": 4
   }
  },
  {
   "slot": 14,
   "name": "strand_begin",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 4,
    "align": 4
   }
  },
  {
   "slot": 16,
   "name": "points",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 4,
    "align": 4
   }
  },
  {
   "slot": 18,
   "name": "joints",
   "required": true,
   "kind": "inline",
   "bytes": 60,
   "align": 4
  },
  {
   "slot": 20,
   "name": "vertices",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 4,
    "align": 4
   }
  },
  {
   "slot": 22,
   "name": "bone_weights",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 4,
    "align": 4
   }
  },
  {
   "slot": 24,
   "name": "triangles",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 4,
    "align": 4
   }
  },
  {
   "slot": 26,
   "name": "material",
   "kind": "inline",
   "bytes": 44,
   "align": 4
  },
  {
   "slot": 28,
   "name": "group_materials",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 48,
    "align": 4
   }
  },
  {
   "slot": 30,
   "name": "root_blend_counts",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 2,
    "align": 2
   }
  },
  {
   "slot": 32,
   "name": "root_blend_points",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 4,
    "align": 4
   }
  },
  {
   "slot": 34,
   "name": "clumps",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 16,
    "align": 4
   }
  },
  {
   "slot": 36,
   "name": "threads",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 48,
    "align": 4
   }
  },
  {
   "slot": 38,
   "name": "cards",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 20,
    "align": 4
   }
  },
  {
   "slot": 40,
   "name": "cloths",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 56,
    "align": 4
   }
  },
  {
   "slot": 42,
   "name": "cloth_triangles",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 4,
    "align": 4
   }
  },
  {
   "slot": 44,
   "name": "cloth_root_distances",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 4,
    "align": 4
   }
  },
  {
   "slot": 46,
   "name": "knots",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 16,
    "align": 4
   }
  },
  {
   "slot": 48,
   "name": "knot_points",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 4,
    "align": 4
   }
  },
  {
   "slot": 50,
   "name": "far_cards",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 16,
    "align": 4
   }
  },
  {
   "slot": 52,
   "name": "far_card_points",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 4,
    "align": 4
   }
  },
  {
   "slot": 54,
   "name": "strand_point_counts",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 4,
    "align": 4
   }
  },
  {
   "slot": 56,
   "name": "point_weights",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 2,
    "align": 2
   }
  },
  {
   "slot": 58,
   "name": "point_references",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 1,
    "align": 1
   }
  },
  {
   "slot": 60,
   "name": "point_planes",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 1,
    "align": 1
   }
  },
  {
   "slot": 62,
   "name": "vertex_planes",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 1,
    "align": 1
   }
  },
  {
   "slot": 64,
   "name": "bone_weight_planes",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 1,
    "align": 1
   }
  },
  {
   "slot": 66,
   "name": "triangle_planes",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 1,
    "align": 1
   }
  },
  {
   "slot": 68,
   "name": "far_card_weights",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 2,
    "align": 2
   }
  },
  {
   "slot": 70,
   "name": "far_card_references",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 1,
    "align": 1
   }
  },
  {
   "slot": 72,
   "name": "far_card_planes",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 1,
    "align": 1
   }
  },
  {
   "slot": 74,
   "name": "cloth_triangle_planes",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 1,
    "align": 1
   }
  },
  {
   "slot": 76,
   "name": "knot_point_planes",
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 1,
    "align": 1
   }
  },
  {
   "slot": 78,
   "name": "learnt",
   "kind": "table",
   "table": "LearntHair"
  },
  {
   "slot": 80,
   "name": "learnt_wind",
   "kind": "table",
   "table": "LearntWind"
  }
 ],
 "LearntHair": [
  {
   "slot": 4,
   "name": "hidden_count",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  },
  {
   "slot": 6,
   "name": "mode_count",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  },
  {
   "slot": 8,
   "name": "input_weights",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 4,
    "align": 4
   }
  },
  {
   "slot": 10,
   "name": "hidden_weights",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 4,
    "align": 4
   }
  },
  {
   "slot": 12,
   "name": "bias",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 4,
    "align": 4
   }
  },
  {
   "slot": 14,
   "name": "output_weights",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 4,
    "align": 4
   }
  },
  {
   "slot": 16,
   "name": "most",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 4,
    "align": 4
   }
  },
  {
   "slot": 18,
   "name": "error",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  },
  {
   "slot": 20,
   "name": "low_error",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  }
 ],
 "LearntWind": [
  {
   "slot": 4,
   "name": "weights",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 4,
    "align": 4
   }
  },
  {
   "slot": 6,
   "name": "most_m_per_s",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  },
  {
   "slot": 8,
   "name": "error",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  },
  {
   "slot": 10,
   "name": "low_error",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  }
 ],
 "BoneSkin": [
  {
   "slot": 4,
   "name": "bone",
   "kind": "inline",
   "bytes": 1,
   "align": 1
  },
  {
   "slot": 6,
   "name": "origin",
   "required": true,
   "kind": "inline",
   "bytes": 12,
   "align": 4
  },
  {
   "slot": 8,
   "name": "cell_m",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  },
  {
   "slot": 10,
   "name": "node_count_x",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  },
  {
   "slot": 12,
   "name": "node_count_y",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  },
  {
   "slot": 14,
   "name": "node_count_z",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  },
  {
   "slot": 16,
   "name": "bytes",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 1,
    "align": 1
   }
  }
 ],
 "HairBasis": [
  {
   "slot": 4,
   "name": "origin",
   "required": true,
   "kind": "inline",
   "bytes": 12,
   "align": 4
  },
  {
   "slot": 6,
   "name": "spacing",
   "required": true,
   "kind": "inline",
   "bytes": 12,
   "align": 4
  },
  {
   "slot": 8,
   "name": "node_count_x",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  },
  {
   "slot": 10,
   "name": "node_count_y",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  },
  {
   "slot": 12,
   "name": "node_count_z",
   "kind": "inline",
   "bytes": 4,
   "align": 4
  },
  {
   "slot": 14,
   "name": "active_nodes",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 4,
    "align": 4
   }
  },
  {
   "slot": 16,
   "name": "trimmed_nodes",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 4,
    "align": 4
   }
  },
  {
   "slot": 18,
   "name": "trimmed_begin",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 4,
    "align": 4
   }
  },
  {
   "slot": 20,
   "name": "trimmed_from",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 4,
    "align": 4
   }
  },
  {
   "slot": 22,
   "name": "trimmed_weights",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 4,
    "align": 4
   }
  },
  {
   "slot": 24,
   "name": "deviation_m",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 4,
    "align": 4
   }
  },
  {
   "slot": 26,
   "name": "unit",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 4,
    "align": 4
   }
  },
  {
   "slot": 28,
   "name": "mode_planes",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "inline",
    "bytes": 1,
    "align": 1
   }
  },
  {
   "slot": 30,
   "name": "skin",
   "required": true,
   "kind": "vector",
   "of": {
    "kind": "table",
    "table": "BoneSkin"
   }
  }
 ]
};
