#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "client/link/members.hpp"
#include "core/assert.hpp"
#include "schema/codec/frame.hpp"
#include "tests/tools/hex.hpp"
#include "tests/tools/web_messages.hpp"
#include "tests/tools/web_modes.hpp"

namespace hairnet {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kSequenceFrames = 16;
constexpr std::int64_t kSequenceTick_ns = 33'000'000;
constexpr std::uint32_t kCharacter = 7, kMember = 300;

Pose pose_at(double t) {
  const Quat turn(Eigen::AngleAxisd(0.8 * std::sin(2 * t), Vec3(0.2, 1, 0.1).normalized()));
  return rigid_pose({turn, Vec3(0.3 * std::sin(t), 1.6, 0.2 * t)});
}

}  // namespace

Json sequence_case() {
  WebRandom random(31);
  const wire::HairBasis basis = make_basis(random, {4, 3, 3}, 6);
  const codec::CoefficientCode code(basis.basis.deviation_m);
  const auto file =
      std::make_shared<const std::vector<std::uint8_t>>(wire::encode_basis(basis.geometry, basis.basis, basis.skin));
  link::Members members(std::make_shared<link::FileCatalog>(), 1);
  const wire::GroomHash groom{1}, hash{2};
  members.add_own({kCharacter, groom, LevelIndex::high, kMember});
  members.bases().announce(groom, hash);
  const std::string fault = members.bases().take({hash, file, {}});
  HAIRNET_ASSERT(fault.empty());
  Json out{{"file", hex(*file)}, {"contents", Json::array()}, {"coefficients", Json::array()}};
  for (int n = 0; n < kSequenceFrames; ++n) {
    const double t = 1e-9 * static_cast<double>(n * kSequenceTick_ns);
    std::vector<float> coefficients;
    for (std::size_t k = 0; k < code.mode_count(); ++k)
      coefficients.push_back(static_cast<float>(0.02 * std::sin(3 * t + static_cast<double>(k))));
    codec::EncodedFrame encoded;
    codec::encode_frame(pose_at(t), &code, coefficients, 1, encoded);
    wire::Frame frame;
    frame.member = kMember;
    frame.level = LevelIndex::low;
    frame.content = encoded.bytes;
    const link::Members::DecodedFrame decoded =
        members.decode_frame(frame, std::nullopt, static_cast<std::uint64_t>(n + 1), n * kSequenceTick_ns, 0);
    HAIRNET_ASSERT(decoded.outcome == link::Members::Outcome::decoded);
    out["contents"].push_back(hex(encoded.bytes));
    out["coefficients"].push_back(std::vector<float>(decoded.coefficients.begin(), decoded.coefficients.end()));
  }
  const wire::HairState state = members.hair_of(kCharacter)->state;
  out["state"] = {{"stepM", state.step_m}, {"displacements", state.displacements}, {"velocities", state.velocities}};
  return out;
}

}  // namespace hairnet
