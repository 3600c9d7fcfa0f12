#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace hairnet {

// A check that a number is in [least, most]. CLI::Range accepts "nan", because no comparison with NaN is true; this one
// demands that both comparisons are. `unit` is for the error's text.
inline CLI::Validator in_range(double least, double most, const std::string& unit = "") {
  return {[least, most, unit](std::string& text) {
            double value = 0;
            if (CLI::detail::lexical_cast(text, value) && value >= least && value <= most) return std::string();
            return "'" + text + "' is not a number in " + CLI::detail::to_string(least) + " ... " +
                   CLI::detail::to_string(most) + (unit.empty() ? "" : " " + unit);
          },
          "NUMBER"};
}

}  // namespace hairnet
