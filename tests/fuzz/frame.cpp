#include "schema/codec/frame.hpp"

#include <algorithm>
#include <cmath>

#include "tests/fuzz/target.hpp"

// A frame of coefficients decoded from any bytes is valid, and is found again in its own encoding.
namespace hairnet::fuzz {
namespace {

void decode(std::span<const std::uint8_t> bytes) {
  static const codec::CoefficientCode code = [] {
    std::vector<float> deviation_m;
    for (int k = 0; k < 64; ++k) deviation_m.push_back(0.2f / static_cast<float>(1 + k));
    return codec::CoefficientCode(deviation_m);
  }();
  codec::DecodedFrame pose_alone, got;
  const bool has_pose = codec::decode_frame(bytes, nullptr, pose_alone);
  if (!codec::decode_frame(bytes, &code, got)) return;
  require(has_pose, "a pose without the coefficients, too");
  require(is_valid(got.pose), "a pose that is valid");
  require(got.coefficients.size() == code.mode_count(), "a coefficient for each mode");
  // The largest coefficient is 2^19 of the coarsest steps, 4096 m.
  const auto is_small = [](float c) { return std::abs(c) <= 5000; };
  require(std::ranges::all_of(got.coefficients, is_small), "coefficients that are finite");
  codec::EncodedFrame encoded;
  codec::encode_frame(got.pose, &code, got.coefficients, codec::kStepCount - 1, encoded);
  codec::DecodedFrame again;
  require(codec::decode_frame(encoded.bytes, &code, again), "decodes again");
  const float half_m = std::ldexp(codec::kFinestStep_m, codec::kStepCount - 2);
  for (std::size_t k = 0; k < code.mode_count(); ++k)
    require(std::abs(again.coefficients[k] - got.coefficients[k]) <= 1.01f * half_m, "the same within half a step");
}

}  // namespace
}  // namespace hairnet::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  hairnet::fuzz::decode({data, size});
  return 0;
}
