#pragma once

#include <string>
#include <tl/expected.hpp>

namespace hairnet {

// A value, or one line about what is wrong with the input and where (the caller adds the file's name).
template <class T>
using Result = tl::expected<T, std::string>;
using Refusal = tl::unexpected<std::string>;

}  // namespace hairnet
