#include "client/hairnet.h"

#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "schema/wire/messages.hpp"

namespace {

using ::testing::HasSubstr;

// Returns the numbers of a pose: for each of five bones a rotation (x, y, z, w) and a position (x, y, z). All turn
// about y.
std::vector<double> pose_at(double x, double turn = 0) {
  std::vector<double> pose(HAIRNET_POSE_NUMBERS, 0);
  for (std::size_t bone = 0; bone < 5; ++bone) {
    pose[7 * bone + 1] = std::sin(turn / 2);
    pose[7 * bone + 3] = std::cos(turn / 2);
    pose[7 * bone + 4] = x;
  }
  return pose;
}

hairnet_groom* make_bob() {
  hairnet_groom* groom = nullptr;
  EXPECT_EQ(hairnet_groom_make("bob", 100, &groom, nullptr, 0), HAIRNET_OK);
  return groom;
}

TEST(HairnetH, says_its_version_and_a_text_for_every_error) {
  EXPECT_STREQ(hairnet_version(), "0.1.0");
  EXPECT_EQ(hairnet_version_number(), 100u);
  for (hairnet_error error = HAIRNET_OK; error <= HAIRNET_OUT_OF_MEMORY; ++error)
    EXPECT_STRNE(hairnet_error_text(error), "unknown error");
  EXPECT_STREQ(hairnet_error_text(99), "unknown error");
}

TEST(HairnetH, a_groom_is_made_of_strands_and_read_back_from_its_file) {
  // The strands hang in a row from the top of the head.
  std::vector<float> points;
  const std::vector<std::uint32_t> counts(50, 8);
  for (int s = 0; s < 50; ++s) {
    for (int p = 0; p < 8; ++p)
      points.insert(points.end(),
                    {0.07f * std::sin(0.1f * static_cast<float>(s)), 0.1f - 0.02f * static_cast<float>(p), 0.06f});
  }
  hairnet_groom* groom = nullptr;
  char error[128] = "";
  ASSERT_EQ(hairnet_groom_from_strands("row", points.data(), counts.data(), 50, 0, 0, &groom, error, sizeof error),
            HAIRNET_OK)
      << error;
  EXPECT_STREQ(hairnet_groom_name(groom), "row");
  EXPECT_EQ(hairnet_groom_strand_count(groom), 50u);
  EXPECT_EQ(hairnet_groom_point_count(groom), 400u);
  EXPECT_EQ(hairnet_groom_strand_begin(groom)[50], 400u);
  std::size_t size = 0;
  // Calls that fill a buffer of the caller say its size when it is too small, or null.
  EXPECT_EQ(hairnet_groom_file(groom, nullptr, &size), HAIRNET_TOO_SMALL);
  std::vector<std::uint8_t> file(size);
  ASSERT_EQ(hairnet_groom_file(groom, file.data(), &size), HAIRNET_OK);
  hairnet_groom* again = nullptr;
  ASSERT_EQ(hairnet_groom_load(file.data(), size, &again, error, sizeof error), HAIRNET_OK) << error;
  std::uint8_t a[HAIRNET_HASH_BYTES], b[HAIRNET_HASH_BYTES];
  hairnet_groom_hash(groom, a);
  hairnet_groom_hash(again, b);
  EXPECT_TRUE(std::equal(a, a + HAIRNET_HASH_BYTES, b));
  hairnet_groom_free(again);
  hairnet_groom_free(groom);

  points[5] = std::numeric_limits<float>::infinity();
  EXPECT_EQ(hairnet_groom_from_strands("row", points.data(), counts.data(), 50, 0, 0, &groom, error, sizeof error),
            HAIRNET_INVALID);
  EXPECT_THAT(error, HasSubstr("point 1"));
  EXPECT_EQ(hairnet_groom_load("not a groom", 11, &groom, error, sizeof error), HAIRNET_MALFORMED);
  EXPECT_STRNE(error, "");
  char one[1] = {'x'};
  EXPECT_EQ(hairnet_groom_make("no_such_style", 100, &groom, one, sizeof one), HAIRNET_INVALID);
  EXPECT_EQ(one[0], 0);
}

TEST(HairnetH, wrong_options_are_named) {
  hairnet_room* room = nullptr;
  char error[128] = "";
  hairnet_options options = HAIRNET_OPTIONS;
  options.room = "no such/name";
  EXPECT_EQ(hairnet_open(&options, 0, &room, error, sizeof error), HAIRNET_INVALID);
  EXPECT_THAT(error, HasSubstr("room"));
  options = HAIRNET_OPTIONS;
  options.connect_timeout_s = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(hairnet_open(&options, 0, &room, error, sizeof error), HAIRNET_INVALID);
  EXPECT_THAT(error, HasSubstr("connect_timeout_s"));
  options = HAIRNET_OPTIONS;
  options.size = 0;
  EXPECT_EQ(hairnet_open(&options, 0, &room, error, sizeof error), HAIRNET_INVALID);
  options = HAIRNET_OPTIONS;
  options.server = "ftp://nowhere";
  EXPECT_EQ(hairnet_connect(&options, &room, error, sizeof error), HAIRNET_INVALID);
  options.server = "127.0.0.1:1";
  options.address_only = 1;
  EXPECT_EQ(hairnet_connect(&options, &room, error, sizeof error), HAIRNET_UNREACHABLE);
  EXPECT_STRNE(error, "");
}

// Plays a server that sends one message to its first client, and ignores what the client sends.
class OneWord {
 public:
  explicit OneWord(hairnet::wire::Message word) : listener_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    EXPECT_EQ(bind(listener_, reinterpret_cast<sockaddr*>(&address), size), 0);
    EXPECT_EQ(listen(listener_, 1), 0);
    getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
    address_ = "127.0.0.1:" + std::to_string(ntohs(address.sin_port));
    thread_ = std::thread([this, packet = hairnet::wire::encode_packet({1, std::move(word)})] {
      const int client = accept(listener_, nullptr, nullptr);
      EXPECT_EQ(send(client, packet.data(), packet.size(), 0), static_cast<ssize_t>(packet.size()));
      char rest[4096];
      while (recv(client, rest, sizeof rest, 0) > 0) {
      }
      close(client);
    });
  }
  ~OneWord() {
    thread_.join();
    close(listener_);
  }
  OneWord(const OneWord&) = delete;
  OneWord& operator=(const OneWord&) = delete;
  [[nodiscard]] const char* address() const { return address_.c_str(); }

 private:
  int listener_;
  std::string address_;
  std::thread thread_;
};

TEST(HairnetH, a_server_that_refuses_is_told_from_one_that_is_not_there) {
  const OneWord server(hairnet::wire::Goodbye{hairnet::wire::GoodbyeReason::token_refused, "the token has expired"});
  hairnet_options options = HAIRNET_OPTIONS;
  options.server = server.address();
  options.address_only = 1;
  hairnet_room* room = nullptr;
  char error[128] = "";
  EXPECT_EQ(hairnet_connect(&options, &room, error, sizeof error), HAIRNET_REFUSED);
  EXPECT_THAT(error, HasSubstr("the token has expired"));
}

// Gives each test a connected room in session 5. The test carries its packets, as a program with a transport of its own
// does, and plays the server.
class HairnetHRoom : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(hairnet_open(nullptr, now_ns_, &room_, nullptr, 0), HAIRNET_OK);
    ASSERT_EQ(hairnet_wants_connection(room_, nullptr, nullptr), 1);
    hairnet_on_opening(room_, now_ns_);
    hairnet_on_open(room_, 0, now_ns_);
    ASSERT_EQ(take<hairnet::wire::Hello>(), 1);
    hairnet::wire::Welcome welcome;
    welcome.session = 5;
    welcome.tick_rate_hz = 30;
    send(welcome);
    hairnet_advance(room_);
  }
  void TearDown() override { hairnet_room_free(room_); }
  void send(hairnet::wire::Message message) {
    const std::vector<std::uint8_t> packet = hairnet::wire::encode_packet({now_ns_, std::move(message)});
    hairnet_on_packet(room_, packet.data(), packet.size(), now_ns_);
  }
  // Takes all that the room sends, and counts the messages of one kind.
  template <class T>
  int take() {
    int count = 0;
    std::size_t size = 0;
    while (const void* packet = hairnet_take_packet(room_, now_ns_, &size, nullptr)) {
      const auto decoded = hairnet::wire::decode_packet({static_cast<const std::uint8_t*>(packet), size});
      count += std::holds_alternative<T>(decoded.envelope.message);
    }
    return count;
  }
  int events(hairnet_event_kind kind) {
    int count = 0;
    for (hairnet_event event; hairnet_next_event(room_, &event) != 0;) count += event.kind == kind;
    return count;
  }
  std::int64_t now_ns_ = 1'000'000'000;
  hairnet_room* room_ = nullptr;
  std::array<char, 200> error_{};
};

TEST_F(HairnetHRoom, an_own_character_is_shown_where_its_pose_is) {
  EXPECT_EQ(hairnet_state(room_), HAIRNET_CONNECTED);
  EXPECT_EQ(events(HAIRNET_EVENT_STATE), 1);
  hairnet_groom* groom = make_bob();
  std::uint32_t me = 0;
  hairnet_character_options options = HAIRNET_CHARACTER_OPTIONS;
  // A tag may hold any bytes, so its size counts and not a zero.
  options.tag = "Ada\0b";
  options.tag_size = 5;
  ASSERT_EQ(hairnet_add_character(room_, groom, &options, &me, error_.data(), error_.size()), HAIRNET_OK);
  EXPECT_EQ(take<hairnet::wire::AddCharacter>(), 1);
  hairnet::wire::CharacterAdded added;
  added.character = me;
  hairnet_groom_hash(groom, added.groom.data());
  added.member = 31;
  send(added);
  EXPECT_EQ(hairnet_push_pose(room_, me, pose_at(2).data(), 0), HAIRNET_OK);
  EXPECT_EQ(take<hairnet::wire::PoseBatch>(), 1);
  hairnet_advance(room_);
  EXPECT_EQ(events(HAIRNET_EVENT_JOINED), 1);
  const hairnet_scene* scene = hairnet_room_scene(room_);
  ASSERT_EQ(hairnet_shown_count(scene), 1u);
  hairnet_shown shown;
  ASSERT_EQ(hairnet_get_shown(scene, 0, &shown, 1), HAIRNET_OK);
  EXPECT_EQ(shown.member, 31u);
  EXPECT_EQ(shown.own, me);
  EXPECT_EQ(shown.session, 5u);
  EXPECT_EQ(std::string(shown.tag, shown.tag_size), std::string("Ada\0b", 5));
  EXPECT_EQ(shown.has_pose, 1u);
  EXPECT_EQ(shown.pose[4], 2);
  // No frame has come yet, so the hair is at rest on the moved head.
  EXPECT_EQ(shown.moves, 0u);
  EXPECT_EQ(shown.appearance.hair_root, 0x7c422cu) << "auburn, the seventh of eight colours";

  const std::size_t count = hairnet_groom_point_count(groom);
  std::vector<float> points(3 * count), tangents(3 * count);
  EXPECT_EQ(hairnet_shown_points(scene, 0, points.data(), nullptr, count - 1), HAIRNET_TOO_SMALL);
  ASSERT_EQ(hairnet_shown_points(scene, 0, points.data(), tangents.data(), count), HAIRNET_OK);
  // The head is at x = 2 m, and hair lies within half a metre of it.
  for (std::size_t i = 0; i < count; ++i) EXPECT_NEAR(points[3 * i], 2, 0.5);
  EXPECT_EQ(hairnet_get_shown(scene, 1, &shown, 1), HAIRNET_NOT_THERE);
  EXPECT_EQ(hairnet_get_shown(scene, 0, &shown, 2), HAIRNET_NOT_THERE);
  EXPECT_EQ(hairnet_get_shown(scene, 1, nullptr, 0), HAIRNET_OK);
  hairnet_groom* again = nullptr;
  ASSERT_EQ(hairnet_shown_groom(scene, 0, &again), HAIRNET_OK);
  EXPECT_EQ(hairnet_groom_point_count(again), count);
  hairnet_groom_free(again);
  hairnet_groom_free(groom);
}

TEST_F(HairnetHRoom, wrong_input_is_refused_and_changes_nothing) {
  hairnet_groom* groom = make_bob();
  std::uint32_t me = 0;
  hairnet_character_options options = HAIRNET_CHARACTER_OPTIONS;
  // A roughness is 0 to 1.
  const hairnet_appearance rough{0, 0, 0, 2};
  options.appearance = &rough;
  EXPECT_EQ(hairnet_add_character(room_, groom, &options, &me, error_.data(), error_.size()), HAIRNET_INVALID);
  options = HAIRNET_CHARACTER_OPTIONS;
  // C lets an enumeration have this value; writing the bytes avoids undefined behaviour in C++.
  const int beyond = HAIRNET_RIGID + 1;
  std::memcpy(&options.level, &beyond, sizeof beyond);
  EXPECT_EQ(hairnet_add_character(room_, groom, &options, &me, error_.data(), error_.size()), HAIRNET_INVALID);
  ASSERT_EQ(hairnet_add_character(room_, groom, nullptr, &me, nullptr, 0), HAIRNET_OK);
  // A rotation with w = 2 is not of unit length.
  std::vector<double> pose = pose_at(0);
  pose[3] = 2;
  EXPECT_EQ(hairnet_push_pose(room_, me, pose.data(), 0), HAIRNET_INVALID);
  EXPECT_EQ(hairnet_push_pose(room_, me + 1, pose_at(0).data(), 0), HAIRNET_NOT_THERE);
  const hairnet_material heavy{1, 1, -1, 1, 1, 0};
  EXPECT_EQ(hairnet_set_material(room_, me, &heavy, error_.data(), error_.size()), HAIRNET_INVALID);
  EXPECT_NE(std::string_view(error_.data()).find("density"), std::string_view::npos) << error_.data();
  hairnet_wind storm = HAIRNET_STILL_AIR;
  storm.gust_ratio = -1;
  EXPECT_EQ(hairnet_set_wind(room_, &storm, nullptr, 0), HAIRNET_INVALID);
  EXPECT_EQ(hairnet_moderate(room_, HAIRNET_MUTE, 77, nullptr, 0, nullptr, nullptr, 0), HAIRNET_NOT_THERE);
  hairnet_counters counters = HAIRNET_COUNTERS;
  hairnet_get_counters(room_, &counters);
  // The pose, the material and the wind count, since a room was given them. Characters that were not added, and
  // calls for a character or session that does not exist, do not.
  EXPECT_EQ(counters.inputs_dropped, 3u);
  hairnet_groom_free(groom);
  EXPECT_EQ(take<hairnet::wire::PoseBatch>(), 0);
  hairnet_close(room_);
  EXPECT_EQ(hairnet_state(room_), HAIRNET_CLOSED);
}

TEST(HairnetHWorld, hair_swings_and_comes_to_rest) {
  hairnet_groom* groom = make_bob();
  hairnet_build* build = nullptr;
  ASSERT_EQ(hairnet_build_begin(groom, &build), HAIRNET_OK);
  hairnet_levels* levels = nullptr;
  ASSERT_EQ(hairnet_build_finish(build, &levels), HAIRNET_OK);
  EXPECT_EQ(hairnet_build_progress(build), 1);
  hairnet_build_free(build);
  std::size_t size = 0;
  EXPECT_EQ(hairnet_levels_file(levels, nullptr, &size), HAIRNET_TOO_SMALL);
  std::vector<std::uint8_t> file(size);
  ASSERT_EQ(hairnet_levels_file(levels, file.data(), &size), HAIRNET_OK);
  hairnet_levels_free(levels);
  char error[128] = "";
  ASSERT_EQ(hairnet_levels_load(groom, file.data(), size, &levels, error, sizeof error), HAIRNET_OK) << error;
  file[file.size() / 2] ^= 1;
  hairnet_levels* damaged = nullptr;
  EXPECT_EQ(hairnet_levels_load(groom, file.data(), size, &damaged, error, sizeof error), HAIRNET_MALFORMED);

  hairnet_world* world = nullptr;
  // A world has 10 to 240 ticks a second (PlayedWorld::kTickRateMin_hz).
  EXPECT_EQ(hairnet_world_make(5, &world), HAIRNET_INVALID);
  ASSERT_EQ(hairnet_world_make(60, &world), HAIRNET_OK);
  std::uint32_t me = 0;
  ASSERT_EQ(hairnet_world_add(world, groom, levels, nullptr, pose_at(0).data(), &me, nullptr, 0), HAIRNET_OK);
  hairnet_groom* other_groom = nullptr;
  ASSERT_EQ(hairnet_groom_make("bob", 50, &other_groom, nullptr, 0), HAIRNET_OK);
  EXPECT_EQ(hairnet_world_add(world, other_groom, levels, nullptr, nullptr, nullptr, error, sizeof error),
            HAIRNET_INVALID);
  EXPECT_STREQ(error, "the levels are of another groom");
  hairnet_groom_free(other_groom);
  const std::size_t count = hairnet_groom_point_count(groom);
  std::vector<float> points(3 * count), rest(3 * count);
  const hairnet_scene* scene = hairnet_world_scene(world);
  ASSERT_EQ(hairnet_shown_points(scene, 0, rest.data(), nullptr, count), HAIRNET_OK);
  const auto furthest = [&] {
    EXPECT_EQ(hairnet_shown_points(scene, 0, points.data(), nullptr, count), HAIRNET_OK);
    float most = 0;
    for (std::size_t i = 0; i < points.size(); ++i) most = std::max(most, std::abs(points[i] - rest[i]));
    return most;
  };
  // The head shakes for half a second, so that its hair swings. Three ticks after the head stops, hair must still move;
  // after ten seconds it must be at rest.
  for (int i = 0; i < 30; ++i) {
    ASSERT_EQ(hairnet_world_push_pose(world, me, pose_at(0, 0.6 * std::sin(0.4 * i)).data(), 0), HAIRNET_OK);
    ASSERT_EQ(hairnet_world_advance(world, 1.0 / 60), HAIRNET_OK);
  }
  ASSERT_EQ(hairnet_world_push_pose(world, me, pose_at(0).data(), 0), HAIRNET_OK);
  for (int i = 0; i < 3; ++i) hairnet_world_advance(world, 1.0 / 60);
  EXPECT_GT(furthest(), 0.005f) << "it goes on swinging";
  for (int i = 0; i < 600; ++i) hairnet_world_advance(world, 1.0 / 60);
  EXPECT_LT(furthest(), 0.001f);
  EXPECT_EQ(hairnet_world_advance(world, -1), HAIRNET_INVALID);
  // As a float its rotation is longer than the world allows.
  std::vector<double> too_long = pose_at(0);
  for (std::size_t bone = 0; bone < 5; ++bone) too_long[7 * bone + 3] = 1.001;
  EXPECT_EQ(hairnet_world_push_pose(world, me, too_long.data(), 0), HAIRNET_INVALID);
  EXPECT_EQ(hairnet_world_advance(world, 0.1), HAIRNET_OK);
  EXPECT_EQ(hairnet_world_remove(world, me), HAIRNET_OK);
  EXPECT_EQ(hairnet_shown_count(scene), 0u);

  // A character without a pose is not drawn. Its first pose counts as no jump, so the hair is at rest there.
  std::uint32_t later = 0;
  ASSERT_EQ(hairnet_world_add(world, groom, levels, nullptr, nullptr, &later, nullptr, 0), HAIRNET_OK);
  hairnet_shown shown;
  const auto look = [&] { return hairnet_get_shown(scene, 0, &shown, 1); };
  ASSERT_EQ(hairnet_world_advance(world, 0.05), HAIRNET_OK);
  ASSERT_EQ(look(), HAIRNET_OK);
  EXPECT_FALSE(shown.has_pose);
  ASSERT_EQ(hairnet_world_push_pose(world, later, pose_at(0.1).data(), 0), HAIRNET_OK);
  ASSERT_EQ(hairnet_world_advance(world, 0.05), HAIRNET_OK);
  ASSERT_EQ(look(), HAIRNET_OK);
  EXPECT_TRUE(shown.has_pose);
  EXPECT_NEAR(shown.pose[4], 0.1, 1e-6);
  for (std::size_t i = 0; i < rest.size(); i += 3) rest[i] += 0.1f;
  EXPECT_LT(furthest(), 0.001f);
  hairnet_world_free(world);

  // A program may draw at uneven times. The hair of a head that turns evenly must end in the same shape for steps of
  // 1/60 s as for steps of 0.5/60 s and 1.5/60 s in turn.
  const auto swung = [&](const std::vector<double>& pictures_s) {
    hairnet_world* other = nullptr;
    EXPECT_EQ(hairnet_world_make(60, &other), HAIRNET_OK);
    EXPECT_EQ(hairnet_world_add(other, groom, levels, nullptr, pose_at(0).data(), nullptr, nullptr, 0), HAIRNET_OK);
    double time_s = 0;
    for (int i = 0; i < 60; ++i) {
      const double step_s = pictures_s[static_cast<std::size_t>(i) % pictures_s.size()];
      time_s += step_s;
      EXPECT_EQ(hairnet_world_push_pose(other, 1, pose_at(0, 2 * time_s).data(), 0), HAIRNET_OK);
      EXPECT_EQ(hairnet_world_advance(other, step_s), HAIRNET_OK);
    }
    EXPECT_EQ(hairnet_shown_points(hairnet_world_scene(other), 0, points.data(), nullptr, count), HAIRNET_OK);
    hairnet_world_free(other);
    return points;
  };
  const std::vector<float> even = swung({1.0 / 60}), uneven = swung({0.5 / 60, 1.5 / 60});
  float most = 0;
  for (std::size_t i = 0; i < even.size(); ++i) most = std::max(most, std::abs(even[i] - uneven[i]));
  EXPECT_LT(most, 0.0005f);
  hairnet_levels_free(levels);
  hairnet_groom_free(groom);
}

TEST(HairnetHWorld, a_build_that_is_not_wanted_any_more_is_cancelled) {
  hairnet_groom* groom = nullptr;
  ASSERT_EQ(hairnet_groom_make("long_curly", 2000, &groom, nullptr, 0), HAIRNET_OK);
  hairnet_build* build = nullptr;
  ASSERT_EQ(hairnet_build_begin(groom, &build), HAIRNET_OK);
  hairnet_groom_free(groom);
  EXPECT_LT(hairnet_build_progress(build), 1);
  hairnet_build_free(build);
}

TEST(HairnetHGeometry, gives_all_parts_of_a_groom) {
  hairnet_groom* groom = make_bob();
  hairnet_geometry* geometry = nullptr;
  // With 1 the call asks for a coarse variant, which only large grooms have.
  EXPECT_EQ(hairnet_geometry_make(groom, 1, &geometry), HAIRNET_NOT_THERE) << "of a hundred strands";
  ASSERT_EQ(hairnet_geometry_make(groom, 0, &geometry), HAIRNET_OK);
  hairnet_geometry_numbers numbers;
  hairnet_get_geometry_numbers(geometry, &numbers);
  EXPECT_EQ(numbers.strand_count, 100u);
  EXPECT_GT(numbers.radius_m, 0.1f);
  const void* bytes = nullptr;
  std::size_t size = 0;
  ASSERT_EQ(hairnet_geometry_part(geometry, HAIRNET_STRAND_POINTS, 0, &bytes, &size), HAIRNET_OK);
  // A point takes four floats, and each has two vertices of 12 bytes.
  const std::size_t points = size / 16;
  EXPECT_GT(points, 100u);
  ASSERT_EQ(hairnet_geometry_part(geometry, HAIRNET_STRAND_VERTICES, 0, &bytes, &size), HAIRNET_OK);
  EXPECT_EQ(size, 2 * points * 12);
  const std::size_t lists = hairnet_geometry_lists(geometry, nullptr, 0);
  std::vector<float> tolerances(lists);
  hairnet_geometry_lists(geometry, tolerances.data(), lists);
  EXPECT_TRUE(std::is_sorted(tolerances.begin(), tolerances.end()));
  for (std::uint32_t list = 0; list < lists; ++list) {
    ASSERT_EQ(hairnet_geometry_part(geometry, HAIRNET_STRAND_INDICES, list, &bytes, &size), HAIRNET_OK);
    const auto* indices = static_cast<const std::uint32_t*>(bytes);
    for (std::size_t i = 0; i < size / 4; ++i) ASSERT_LT(indices[i], 2 * points);
  }
  EXPECT_EQ(hairnet_geometry_part(geometry, HAIRNET_STRAND_INDICES, static_cast<std::uint32_t>(lists), &bytes, &size),
            HAIRNET_NOT_THERE);
  ASSERT_EQ(hairnet_geometry_part(geometry, HAIRNET_BODY_VERTICES, 0, &bytes, &size), HAIRNET_OK);
  // A vertex of the body takes 32 bytes.
  EXPECT_EQ(size % 32, 0u);
  hairnet_geometry_free(geometry);
  hairnet_groom_free(groom);
}

}  // namespace
