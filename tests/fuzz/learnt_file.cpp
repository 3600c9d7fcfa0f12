#include "schema/wire/learnt_file.hpp"

#include <algorithm>
#include <cmath>

#include "schema/wire/packing.hpp"
#include "tests/fuzz/target.hpp"

// A file of learnt hair is refused with one line, or gives a valid network that survives another round unchanged and
// makes finite hair. The input is the table, which the target packs: bytes would hardly ever inflate.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hairnet;
  const std::vector<std::uint8_t> table(data, data + size);
  const Result<LearntHair> got = wire::decode_learnt(wire::pack(table, wire::kPackedLearnt));
  if (!got) {
    fuzz::require(!got.error().empty(), "a refusal has a line");
    return 0;
  }
  fuzz::require(validate(*got).empty(), "valid: " + validate(*got));
  const std::vector<std::uint8_t> encoded = wire::encode_learnt(*got);
  const Result<LearntHair> again = wire::decode_learnt(encoded);
  fuzz::require(again.has_value(), "encoded again it is refused");
  fuzz::require(wire::encode_learnt(*again) == encoded, "the same bytes again");
  LearntState state;
  std::vector<float> c(got->mode_count);
  for (const double x : {0.0, 0.5, 2e4}) {
    const Pose pose = rigid_pose({Quat(0, 1, 0, 0), {x, -1e4, 1}});
    LearntMember member{&state, &pose, c};
    step_learnt(*got, {&member, 1});
    fuzz::require(std::ranges::all_of(c, [](float value) { return std::isfinite(value); }), "finite coefficients");
  }
  return 0;
}
