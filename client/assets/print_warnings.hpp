#pragma once

#include <span>
#include <string>

namespace hairnet {

// Prints each as a line `FILE: warning` on stderr.
void print_warnings(const std::string& file, std::span<const std::string> warnings);

}  // namespace hairnet
