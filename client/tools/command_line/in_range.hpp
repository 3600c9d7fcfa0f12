#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace hairnet {

// CLI::Range accepts "nan", because no comparison with NaN is true.
inline CLI::Validator in_range(double least, double most) {
  return {[least, most](std::string& text) {
            double value = 0;
            if (CLI::detail::lexical_cast(text, value) && value >= least && value <= most) return std::string();
            return "'" + text + "' is not a number in " + CLI::detail::to_string(least) + " ... " +
                   CLI::detail::to_string(most);
          },
          "NUMBER"};
}

}  // namespace hairnet
