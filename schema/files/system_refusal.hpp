#pragma once

#include <cerrno>
#include <cstring>
#include <string>

#include "core/result.hpp"

namespace hairnet {

// "cannot be opened: No such file or directory": what failed, and the reason that the system gave last.
inline Refusal system_refusal(const char* what) {
  return Refusal(std::string(what) + ": " + std::strerror(errno));
}

}  // namespace hairnet
