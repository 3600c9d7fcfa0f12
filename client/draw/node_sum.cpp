#include "client/draw/node_sum.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <string>

namespace hairnet::draw {

NodeSum node_sum_for(std::string_view renderer) {
  // Parts of the names of software renderers (of Chromium, Mesa and Windows), in lower case.
  constexpr std::array<std::string_view, 5> kSoftware{"swiftshader", "llvmpipe", "softpipe", "software",
                                                      "microsoft basic render"};
  std::string name;
  for (const char letter : renderer) name += static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
  const bool is_software =
      std::ranges::any_of(kSoftware, [&](std::string_view word) { return name.find(word) != std::string::npos; });
  return is_software ? NodeSum::processor : NodeSum::gpu;
}

}  // namespace hairnet::draw
