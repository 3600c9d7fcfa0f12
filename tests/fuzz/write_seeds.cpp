#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string>

#include "client/files/write_file.hpp"
#include "client/tools/command_line/parse.hpp"
#include "schema/channel/token.hpp"
#include "schema/codec/frame.hpp"
#include "schema/codec/hand_code.hpp"
#include "schema/http3/control_stream.hpp"
#include "schema/wire/basis_file.hpp"
#include "schema/wire/frame_datagram.hpp"
#include "schema/wire/groom_file.hpp"
#include "schema/wire/learnt_file.hpp"
#include "schema/wire/level_file.hpp"
#include "schema/wire/messages.hpp"
#include "schema/wire/packing.hpp"
#include "schema/wire/recording.hpp"
#include "tests/fuzz/link_prologue.hpp"
#include "tests/support/abc_writer.hpp"
#include "tests/support/http3_client.hpp"
#include "tests/support/learnt.hpp"
#include "tests/support/levels.hpp"
#include "tests/support/random_messages.hpp"

// Writes the corpora that fuzzing starts from, by our own encoders.
namespace hairnet::fuzz {
namespace {

using Bytes = std::vector<std::uint8_t>;

class Folder {
 public:
  explicit Folder(std::filesystem::path path) : path_(std::move(path)) { std::filesystem::create_directories(path_); }
  void add(const Bytes& bytes) {
    const std::string path = (path_ / ("seed_" + std::to_string(count_++))).string();
    if (const auto written = write_file(path, std::as_bytes(std::span(bytes))); !written)
      failed_ = std::fprintf(stderr, "%s: %s\n", path.c_str(), written.error().c_str()) != 0;
  }
  [[nodiscard]] bool failed() const { return failed_; }

 private:
  std::filesystem::path path_;
  int count_ = 0;
  bool failed_ = false;
};

void append(Bytes& stream, const Bytes& packet) {
  stream.insert(stream.end(), packet.begin(), packet.end());
}

void add_packet_seeds(Folder& packets, Folder& streams) {
  // The two shortest of twelve random packets of a kind become seeds: short seeds make fuzzing quick.
  constexpr std::size_t kPacketsEach = 2, kTries = 12;
  wire::RandomMessages random(1);
  // The first byte sets the length of the pieces of the stream (packet_splitter.cpp); any value will do.
  Bytes stream{13};
  for (std::size_t kind = 0; kind < wire::kMessageKinds; ++kind) {
    std::vector<Bytes> of_kind;
    for (std::size_t n = 0; n < kTries; ++n) of_kind.push_back(wire::encode_packet(random.envelope(kind)));
    std::ranges::stable_sort(of_kind, {}, &Bytes::size);
    for (std::size_t n = 0; n < kPacketsEach; ++n) {
      packets.add(of_kind[n]);
      append(stream, of_kind[n]);
    }
    if (kind % 4 != 3) continue;
    streams.add(stream);
    stream.assign(1, static_cast<std::uint8_t>(kind));
  }
}

void add_frame_datagram_seeds(Folder& packets) {
  wire::RandomMessages random(2);
  for (int n = 0; n < 4;) {
    wire::FrameBatch batch = random.frame_batch();
    batch.generations.resize(batch.frames.size());
    if (batch.frames.empty()) continue;
    const Bytes datagram = wire::encode_frame_datagram(batch.sample_time_ns, batch);
    if (datagram.empty()) continue;
    packets.add(datagram);
    ++n;
  }
}

// Packets that a server may send, with and without the fuzzer's own prologue.
void add_link_seeds(Folder& folder) {
  const auto add = [&](std::uint8_t first, const std::vector<wire::Message>& messages) {
    Bytes stream{first};
    for (const wire::Message& message : messages) append(stream, wire::encode_packet({1'000'000'000, message}));
    folder.add(stream);
  };
  // These are the bits of the first byte that link_core.cpp reads.
  constexpr std::uint8_t kPrologue = 8, kResumed = 16, kLongPieces = 7;
  const wire::Goodbye draining{wire::GoodbyeReason::server_draining, ""};
  const wire::Error refused{wire::ErrorReason::groom_invalid, 0, link_groom(), ""};
  add(kLongPieces, link_prologue(3, false));
  add(kLongPieces | kPrologue, {link_frames(103), link_frames(104), link_frames(107)});
  add(kPrologue | kResumed, {link_frames(103), draining, link_frames(103)});
  add(kLongPieces | kPrologue,
      {wire::GroomNeed{link_groom(), 100'000}, wire::GroomStatus{link_groom(), wire::GroomState::ready},
       wire::GroomData{{9}, 6, 0, {1, 2, 3}}, wire::GroomData{{9}, 6, 3, {4, 5, 6}}});
  add(kLongPieces | kPrologue,
      {link_learnt_frames(103, false), link_learnt_frames(104, false), link_learnt_frames(105, true),
       link_learnt_frames(107, true), link_frames(108), link_learnt_frames(120, true)});
  add(kLongPieces | kPrologue, {refused, wire::MemberLeft{kOtherMember}, wire::CharacterRemoved{kOwnCharacter},
                                wire::Error{wire::ErrorReason::groom_unavailable, 0, {9}, ""}, link_frames(103)});
}

void add_token_seeds(Folder& folder) {
  const channel::TokenKey key(Bytes(channel::kTokenKeyBytesMin, 7));
  const auto add = [&](char first, const std::string& text) {
    Bytes bytes{static_cast<std::uint8_t>(first)};
    bytes.insert(bytes.end(), text.begin(), text.end());
    folder.add(bytes);
  };
  channel::TokenClaims claims;
  claims.expires_s = 1'900'000'000;
  add(0, channel::sign(claims, key));
  add(0, key.to_text() + "\n");
  claims.room = "hall";
  claims.not_before_s = 1'700'000'000;
  claims.characters_max = 4;
  claims.name = "a";
  add(0, channel::sign(claims, key));
  add(1, R"({"room":"hall","role":"observer","exp":1900000000,"nbf":1.5e9,"strands_max":9,"aud":["hairnet"]})");
  add(1, R"({"role":"observer","exp":1900000000,"sub":"a/b","jti":"7","upload":true,"wind":false})");
  add(1, R"({"role":"participant","exp":1900000000.5,"name":"\u00e9","aud":"hairnet","x":{"y":[null,true]}})");
}

void add_file_seeds(Folder& grooms, Folder& levels, Folder& recordings) {
  wire::RandomMessages random(2);
  for (std::size_t strands : {0, 1, 3, 8, 70}) {
    const Bytes groom = wire::encode_groom(random.groom(strands));
    grooms.add(groom);
    grooms.add(wire::unpack(groom, wire::kPackedGroom).value());
  }
  for (int nodes_per_axis : {2, 3}) {
    LevelSet set;
    for (Level& level : set.levels)
      level = support::make_random_level({.nodes_per_axis = nodes_per_axis,
                                          .spring_count = 4,
                                          .attachment_count = 2,
                                          .contact_count = 2,
                                          .skin_nodes_per_axis = 2});
    levels.add(wire::encode_levels({}, set));
  }
  for (int n = 0; n < 3; ++n) {
    Bytes recording = wire::encode_record_entry(random.recording_header());
    append(recording, wire::encode_record_entry(wire::RecordedGroom{{1, 2, 3}}));
    append(recording, wire::encode_record_entry(random.recorded_tick()));
    recordings.add(recording);
  }
}

void add_mode_seeds(Folder& frames, Folder& bases) {
  wire::RandomMessages random(5);
  wire::HairBasis hair;
  hair.geometry = random.geometry();
  hair.basis.node_count = hair.geometry.active_nodes.size();
  for (int k = 0; k < 64; ++k) {
    hair.basis.deviation_m.push_back(0.2f / static_cast<float>(1 + k));
    if (k >= 8) continue;
    hair.basis.unit.push_back(1e-3f);
    for (std::size_t i = 0; i < 3 * hair.basis.node_count; ++i)
      hair.basis.modes.push_back(static_cast<std::int16_t>(random.integer(0, 2000)));
  }
  const codec::CoefficientCode code(hair.basis.deviation_m);
  for (unsigned step = 0; step < codec::kStepCount; step += 3) {
    std::vector<float> coefficients;
    for (const float deviation : hair.basis.deviation_m)
      coefficients.push_back(deviation * static_cast<float>(random.real(-1, 1)));
    codec::EncodedFrame frame;
    codec::encode_frame(random.pose(), &code, coefficients, step, frame);
    frames.add(frame.bytes);
  }
  hair.basis.deviation_m.resize(8);
  for (const Bone bone : {Bone::head, Bone::neck}) {
    SkinDistanceField& field = hair.skin.emplace_back();
    field = {bone, Vec3f(-0.1f, -0.1f, -0.1f), 0.02f, {4, 3, 5}, {}};
    for (int node = 0; node < 60; ++node) field.distance.push_back(static_cast<float>(random.real(-0.06, 0.03)));
  }
  bases.add(wire::unpack(wire::encode_basis(hair.geometry, hair.basis, hair.skin), wire::kPackedBasis).value());
}

void add_learnt_seeds(Folder& folder) {
  for (const std::size_t hidden : {4, 8})
    folder.add(
        wire::unpack(wire::encode_learnt(support::random_learnt_hair(6, hidden, 4)), wire::kPackedLearnt).value());
}

void add_hand_seeds(Folder& folder) {
  wire::RandomMessages random(6);
  for (int n = 0; n < 8;) {
    const std::vector<Hand> hands = random.hands();
    if (hands.empty()) continue;
    folder.add(codec::encode_hands(hands));
    ++n;
  }
}

// Steps as http3_connection.cpp reads them.
void add_http3_step(Bytes& steps, unsigned kind, unsigned stream, const Bytes& bytes) {
  steps.push_back(static_cast<std::uint8_t>(kind | stream / 2 << 3));
  steps.push_back(static_cast<std::uint8_t>(bytes.size()));
  append(steps, bytes);
}

void add_http3_seeds(Folder& folder) {
  constexpr unsigned kBytes = 0, kLastBytes = 1, kReset = 2, kDatagram = 4, kCloseSession = 6;
  Bytes opening, steps;
  add_http3_step(opening, kBytes, 2, http3::control_stream());
  add_http3_step(opening, kBytes, 6, {0x02, 0x20});
  add_http3_step(opening, kBytes, 10, {0x03});
  add_http3_step(opening, kBytes, 0, http3::connect_request("localhost:7420", "/ws"));
  add_http3_step(opening, kBytes, 4, http3::channel_begin(0));
  add_http3_step(opening, kBytes, 4, {1, 2, 3});
  add_http3_step(opening, kDatagram, 0, {0, 9});
  folder.add(opening);
  steps = opening;
  add_http3_step(steps, kBytes, 0, http3::close_session_capsule(1, "done"));
  folder.add(steps);
  steps = opening;
  add_http3_step(steps, kLastBytes, 4, {});
  add_http3_step(steps, kReset, 0, {});
  folder.add(steps);
  steps = opening;
  add_http3_step(steps, kBytes, 0, http3::drain_session_capsule());
  add_http3_step(steps, kCloseSession, 0, {});
  folder.add(steps);
  steps.clear();
  add_http3_step(steps, kLastBytes, 0,
                 http3::headers_frame({{":method", "GET"}, {":scheme", "https"}, {":authority", "a"}, {":path", "/"}}));
  add_http3_step(steps, kBytes, 14, {0x40, 0x54, 0});
  folder.add(steps);
}

// Steps as http3_session.cpp reads them.
void add_http3_answer(Bytes& steps, unsigned kind, unsigned stream, const Bytes& bytes) {
  steps.push_back(static_cast<std::uint8_t>(kind | stream << 3));
  steps.push_back(static_cast<std::uint8_t>(bytes.size()));
  append(steps, bytes);
}

void add_http3_session_seeds(Folder& folder) {
  constexpr unsigned kBytes = 0, kLastBytes = 1, kReset = 2, kStop = 3, kDatagram = 4;
  const auto answer = [](int status) {
    Bytes frame;
    http3::put_frame(frame, http3::kHeadersFrame, http3::encode_response(status, true));
    return frame;
  };
  Bytes opening, steps;
  add_http3_answer(opening, kBytes, 3, http3::control_stream_begin());
  add_http3_answer(opening, kBytes, 7, {0x02, 0x20});
  add_http3_answer(opening, kBytes, 11, {0x03});
  steps = opening;
  add_http3_answer(steps, kLastBytes, 0, answer(404));
  folder.add(steps);
  add_http3_answer(opening, kBytes, 0, answer(200));
  add_http3_answer(opening, kBytes, 4, {1, 2, 3});
  add_http3_answer(opening, kDatagram, 0, {0, 9});
  folder.add(opening);
  steps = opening;
  add_http3_answer(steps, kBytes, 0, http3::drain_session_capsule());
  add_http3_answer(steps, kLastBytes, 4, {});
  add_http3_answer(steps, kBytes, 0, http3::close_session_capsule(1, "done"));
  folder.add(steps);
  steps = opening;
  add_http3_answer(steps, kReset, 15, {});
  add_http3_answer(steps, kStop, 2, {});
  folder.add(steps);
}

void add_alembic_seeds(Folder& archives) {
  using namespace hairnet::test;
  const auto add = [&](const std::vector<AbcObj>& objects) {
    const AbcBytes bytes = abc_file(objects);
    const auto* data = reinterpret_cast<const std::uint8_t*>(bytes.data());
    archives.add(Bytes(data, data + bytes.size()));
  };
  const std::vector<float> four{0, 0, 0, 0, 1, 0, 1, 2, 0, 2, 3, 0};
  add({test::curves(
      "hair", {3, 3}, {row_of_strands(2)}, {1, 0, 0}, {attribute<float>("width", "con", {1})},
      {texts("groom_group_name", "uni", {"a", "b"}), attribute<std::int16_t>("groom_guide", "uni", {0, 1})})});
  add({xform("head", {0x13, 0x60}, {{0, 2, 0, 30}, {1, 2, 0, 60}},
             {test::curves("b", {4}, {four, four}, {0, 1, 2}), test::curves("z", {4}, {four}, {0, 0, 1})})});
  add({test::curves(
           "n", {4}, {four}, {2, 0, 2},
           {test::numbers<float>(".knots", {{0, 0, 0, 0, 1, 1, 1, 1}}), test::numbers<std::uint8_t>(".orders", {{4}}),
            test::numbers<float>("w", {{1, 2, 1, 1}}), test::indexed<float>("width", "vtx", {1, 2}, {0, 1, 0, 1})}),
       object_of("mesh", "AbcGeom_PolyMesh_v1")});
}

int write_seeds(const std::filesystem::path& root) {
  Folder packets(root / "packet"), streams(root / "packet_splitter");
  Folder grooms(root / "groom_file"), levels(root / "level_file"), recordings(root / "recording");
  Folder tokens(root / "token"), links(root / "link_core");
  Folder http3(root / "http3_connection"), http3_sessions(root / "http3_session");
  Folder frames(root / "frame"), bases(root / "basis_file"), learnt(root / "learnt_file");
  Folder archives(root / "alembic"), hands(root / "hands");
  add_alembic_seeds(archives);
  add_packet_seeds(packets, streams);
  add_frame_datagram_seeds(packets);
  add_file_seeds(grooms, levels, recordings);
  add_token_seeds(tokens);
  add_link_seeds(links);
  add_mode_seeds(frames, bases);
  add_learnt_seeds(learnt);
  add_hand_seeds(hands);
  add_http3_seeds(http3);
  add_http3_session_seeds(http3_sessions);
  for (const Folder* folder : {&packets, &streams, &grooms, &levels, &recordings, &tokens, &links, &frames, &bases,
                               &learnt, &http3, &http3_sessions, &archives, &hands})
    if (folder->failed()) return 1;
  return 0;
}

}  // namespace
}  // namespace hairnet::fuzz

int main(int argc, char** argv) {
  CLI::App app("Writes the corpora that fuzzing starts from, by our own encoders.", "hairnet-fuzz-seeds");
  app.footer("Example:\n  hairnet-fuzz-seeds tests/fuzz/corpus\n");
  std::string folder;
  app.add_option("folder", folder, "where; a folder for each target is made there")->required();
  if (const auto exit_status = hairnet::parse_command_line(app, argc, argv)) return *exit_status;
  return hairnet::fuzz::write_seeds(folder);
}
