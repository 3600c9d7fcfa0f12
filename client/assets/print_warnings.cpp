#include "client/assets/print_warnings.hpp"

#include <cstdio>

namespace hairnet {

void print_warnings(const std::string& file, std::span<const std::string> warnings) {
  for (const std::string& warning : warnings) std::fprintf(stderr, "%s: %s\n", file.c_str(), warning.c_str());
}

}  // namespace hairnet
