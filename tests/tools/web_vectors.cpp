#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <span>
#include <string>

#include "client/assets/made/made.hpp"
#include "client/files/read_file.hpp"
#include "client/files/write_file.hpp"
#include "client/tools/command_line/parse.hpp"
#include "schema/wire/earlier_pose.hpp"
#include "schema/wire/frame_datagram.hpp"
#include "schema/wire/groom_file.hpp"
#include "tests/support/learnt.hpp"
#include "tests/support/random_messages.hpp"
#include "tests/tools/hex.hpp"
#include "tests/tools/web_hair.hpp"
#include "tests/tools/web_learnt.hpp"
#include "tests/tools/web_messages.hpp"
#include "tests/tools/web_modes.hpp"

// Writes the results of the C++ libraries for packets, frames, grooms and hair, which the web client's tests must
// reproduce; and reads the packets that those tests encoded.
namespace hairnet {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kPacketsOfAKind = 12;
constexpr std::size_t kSpoiltPackets = 6000;
constexpr std::size_t kFrameDatagrams = 2000;
constexpr std::uint32_t kEarlierPoses = 100;
constexpr std::int64_t kExactTime_ns = std::int64_t{1} << 52;

// Numbers that a double represents exactly, and values that a client's own checks accept.
struct Tame {
  void operator()(wire::Hello& m) const { m.room = "hall-2.b_" + std::to_string(m.room.size()); }
  void operator()(wire::GroomOffer& m) const { m.byte_count = 1 + m.byte_count % 1'000'000; }
  void operator()(wire::GroomChunk& m) const { m.offset %= 1'000'000; }
  void operator()(wire::AddCharacter& m) const { m.character |= 1; }
  void operator()(wire::SetLevel& m) const { m.character |= 1; }
  void operator()(wire::RemoveCharacter& m) const { m.character |= 1; }
  void operator()(wire::SetMaterial& m) const { m.character |= 1; }
  void operator()(wire::GroomRequest& m) const { m.offset %= 1'000'000; }
  void operator()(wire::PoseBatch& m) const {
    for (wire::PoseSample& pose : m.poses) {
      pose.character |= 1;
      pose.capture_time_ns %= kExactTime_ns;
    }
  }
  void operator()(auto&) const {}
};

Json packet_case(wire::Envelope envelope, bool tame) {
  if (tame) {
    envelope.clock_ns %= kExactTime_ns;
    std::visit(Tame(), envelope.message);
  }
  return {{"tame", tame},
          {"packet", hex(wire::encode_packet(envelope))},
          {"clockNs", std::to_string(envelope.clock_ns)},
          {"message", to_json(envelope.message)}};
}

Json packet_cases() {
  Json cases = Json::array();
  wire::RandomMessages random(7);
  for (std::size_t kind = 0; kind < wire::kMessageKinds; ++kind) {
    for (std::size_t n = 0; n < kPacketsOfAKind; ++n) cases.push_back(packet_case(random.envelope(kind), n % 2 == 0));
  }
  return cases;
}

// Poses that were sent before, as rounded: a reader's arithmetic may differ by the last digit.
Json earlier_pose_cases() {
  Json cases = Json::array();
  wire::RandomMessages random(10);
  for (std::uint32_t n = 0; n < kEarlierPoses; ++n) {
    const wire::PoseSample later{1 + n, 2, 28'000'000, false, random.pose()};
    wire::PoseSample earlier{1 + n, 1 - 300 * n, 28'000'000 - n, false, later.pose};
    for (RigidTransform& bone : earlier.pose.bones) {
      const Vec3 axis(random.real(-1, 1), random.real(-1, 1), random.real(0.1, 1));
      bone.rotation = Quat(Eigen::AngleAxisd(random.real(-2, 2), axis.normalized())) * bone.rotation;
      bone.position += Vec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
    }
    const wire::PoseBatch batch{{later}, {wire::to_earlier(earlier, later).value()}};
    const wire::PoseBatch read{{wire::from_earlier(batch.earlier[0], later)}};
    cases.push_back(
        {{"packet", hex(wire::encode_packet({0, batch}))}, {"earlier", to_json(wire::Message(read))["poses"]}});
  }
  return cases;
}

// Packets with a few bytes changed, and whether they can still be read.
Json spoilt_cases() {
  Json cases = Json::array();
  wire::RandomMessages random(8);
  for (std::size_t n = 0; n < kSpoiltPackets; ++n) {
    std::vector<std::uint8_t> packet = wire::encode_packet(random.envelope(n % wire::kMessageKinds));
    if (packet.size() > 1000) continue;
    for (std::uint64_t changes = random.integer(1, 3); changes > 0; --changes) {
      const std::size_t at = random.integer(0, packet.size() - 1);
      packet[at] =
          static_cast<std::uint8_t>(random.coin() ? packet[at] ^ 1u << random.integer(0, 7) : random.integer(0, 255));
    }
    const wire::DecodedPacket decoded = wire::decode_packet(packet);
    cases.push_back({{"packet", hex(packet)}, {"error", wire::to_string(decoded.error)}});
  }
  return cases;
}

// Frame datagrams, three of four with a few bytes changed behind the mark, and what they say if they can be read.
Json frame_datagram_cases() {
  Json cases = Json::array();
  wire::RandomMessages random(9);
  for (std::size_t n = 0; n < kFrameDatagrams; ++n) {
    wire::FrameBatch batch = random.frame_batch();
    if (batch.frames.empty()) continue;
    batch.generations.assign(batch.frames.size(), static_cast<std::uint8_t>(random.integer(0, 255)));
    std::vector<std::uint8_t> bytes =
        wire::encode_frame_datagram(batch.sample_time_ns + static_cast<std::int64_t>(random.real(-1e10, 1e10)), batch);
    if (bytes.empty()) continue;
    for (std::uint64_t changes = n % 4; changes > 0; --changes)
      bytes[random.integer(2, std::min<std::size_t>(40, bytes.size() - 1))] =
          static_cast<std::uint8_t>(random.integer(0, 255));
    if (n % 8 == 7) bytes.resize(random.integer(2, bytes.size()));
    const wire::DecodedPacket decoded = wire::decode_frame_datagram(bytes);
    Json& each = cases.emplace_back(Json{{"packet", hex(bytes)}, {"error", wire::to_string(decoded.error)}});
    if (decoded.error != wire::DecodeError::none) continue;
    each["clockNs"] = std::to_string(decoded.envelope.clock_ns);
    each["message"] = to_json(decoded.envelope.message);
  }
  return cases;
}

bool write(const std::filesystem::path& folder, const char* name, std::span<const std::byte> bytes) {
  const std::string path = folder / name;
  const auto written = write_file(path, bytes);
  if (!written) std::fprintf(stderr, "hairnet-web-vectors: %s: %s\n", path.c_str(), written.error().c_str());
  return written.has_value();
}

bool write(const std::filesystem::path& folder, const char* name, const Json& json) {
  const std::string text = json.dump() + "\n";
  return write(folder, name, std::as_bytes(std::span(text)));
}

// For a server to build and step. `learnt`: goes into the file.
std::vector<std::uint8_t> whole_groom(const LearntHair* learnt = nullptr) {
  return wire::encode_groom(make_hairstyle("bob", {.strand_count = 120}).value(), learnt);
}

int write_all(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  const LearntHair learnt = support::random_learnt_hair(7);
  const std::vector<std::uint8_t> groom = whole_groom(), with_learnt = whole_groom(&learnt);
  const bool done =
      write(folder, "packets.json", packet_cases()) && write(folder, "spoilt.json", spoilt_cases()) &&
      write(folder, "frame_datagrams.json", frame_datagram_cases()) &&
      write(folder, "earlier_poses.json", earlier_pose_cases()) && write(folder, "sequence.json", sequence_case()) &&
      write(folder, "ffd.json", ffd_cases()) && write(folder, "grooms.json", groom_cases()) &&
      write(folder, "spoilt_grooms.json", spoilt_groom_cases()) &&
      write(folder, "root_blend.json", root_blend_cases()) && write(folder, "playout.json", playout_cases()) &&
      write(folder, "drawing.json", drawing_cases()) && write(folder, "frame.json", frame_code_cases()) &&
      write(folder, "basis.json", basis_cases()) && write(folder, "skin.json", skin_case()) &&
      write(folder, "learnt.json", learnt_cases()) && write(folder, "bob.groom", std::as_bytes(std::span(groom))) &&
      write(folder, "bob_learnt.groom", std::as_bytes(std::span(with_learnt)));
  return done ? 0 : 1;
}

std::string fault_of(const Json& encoded) {
  const auto packet = from_hex(encoded.at("packet").get<std::string>());
  if (!packet) return "not hexadecimal";
  const wire::DecodedPacket decoded = wire::decode_packet(*packet);
  if (decoded.error != wire::DecodeError::none) return wire::to_string(decoded.error) + (": " + decoded.detail);
  const Json message = to_json(decoded.envelope.message);
  if (message != encoded.at("message")) return "reads as " + message.dump();
  return std::to_string(decoded.envelope.clock_ns) == encoded.at("clockNs") ? "" : "another clock";
}

// Decodes the packets that the web client's tests have encoded, [{packet, clockNs, message}], and compares the
// messages.
int check(const std::string& path) {
  const auto bytes = read_file(path);
  if (!bytes) {
    std::fprintf(stderr, "hairnet-web-vectors: %s: %s\n", path.c_str(), bytes.error().c_str());
    return 1;
  }
  const Json cases = Json::parse(*bytes, nullptr, false);
  if (!cases.is_array() || cases.empty()) {
    std::fprintf(stderr, "hairnet-web-vectors: %s: not a list of packets\n", path.c_str());
    return 1;
  }
  int faults = 0;
  for (const Json& encoded : cases) {
    const std::string fault = fault_of(encoded);
    if (fault.empty()) continue;
    ++faults;
    std::fprintf(stderr, "hairnet-web-vectors: %s: %s\n", encoded.at("message").dump().c_str(), fault.c_str());
  }
  std::printf("%zu packets of the web client read, %d wrong\n", cases.size(), faults);
  return faults == 0 ? 0 : 1;
}

}  // namespace
}  // namespace hairnet

int main(int argc, char** argv) {
  CLI::App app("Writes vectors for the tests of client/web, or checks the packets that they encoded.",
               "hairnet-web-vectors");
  std::string folder, packets;
  app.add_option("folder", folder, "to write vectors to");
  app.add_option("--check", packets, "packets.json of the web client's tests, to read");
  app.require_option(1);
  if (const auto exit_status = hairnet::parse_command_line(app, argc, argv)) return *exit_status;
  return packets.empty() ? hairnet::write_all(folder) : hairnet::check(packets);
}
