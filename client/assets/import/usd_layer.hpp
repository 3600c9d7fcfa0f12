#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "client/assets/import/usd_crate.hpp"
#include "client/assets/import/usda.hpp"
#include "core/result.hpp"

namespace hairnet::usda {

// The scene of a USD file: text, binary, or the first file of an archive. Of a binary file only what `content` says is
// read. The layer's texts are views of `bytes` and `unpacked`, which must outlive it.
Result<Layer> open_layer(std::span<const std::byte> bytes, Content content, std::string& unpacked);

}  // namespace hairnet::usda
