#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "client/assets/import/hair_import.hpp"
#include "client/tools/command_line/in_range.hpp"

namespace hairnet {

// Adds a flag whose text is checked and stored: `parse` returns a value or one line, which CLI11 prints after the
// flag's name. `target` must outlive the parsing.
template <class Target, class Parse>
CLI::Option* add_parsed(CLI::App& app, const std::string& flag, Target& target, const std::string& about, Parse parse) {
  return app.add_option_function<std::string>(
      flag,
      [flag, &target, parse](const std::string& text) {
        const auto value = parse(text);
        if (!value) throw CLI::ValidationError(flag, value.error());
        target = *value;
      },
      about);
}

// Adds flags for what the strand files of a command line do not show, which is guessed without them. `prefix` is "--",
// or "--hair-" where a program has such flags for motions. Fills `import` while parsing; it must outlive the parsing.
inline void add_hair_flags(CLI::App& app, const std::string& prefix, HairImport& import) {
  // Messages of the import name the flags that would help, so they need the prefix.
  import.flag_prefix = prefix;
  add_parsed(app, prefix + "up", import.strands.up, "strand files: axis that points up (guessed)", parse_axis);
  add_parsed(app, prefix + "face", import.strands.face, "strand files: axis that the face looks along (guessed)",
             parse_axis);
  app.add_option(prefix + "unit", import.strands.unit_m, "strand files: metres a file unit (guessed)")
      ->check(in_range(1e-6, 1e3, "metres"));
  add_parsed(app, prefix + "roots", import.roots,
             "strand files: which point of a strand is its root, first or last (guess)", parse_root_end);
  app.add_flag(prefix + "strict", import.strict,
               "refuse strand files of which something would be cut, or taken in spite of a doubt");
}

}  // namespace hairnet
