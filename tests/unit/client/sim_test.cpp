#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "client/assets/import/alembic.hpp"
#include "client/assets/made/made.hpp"
#include "client/tools/sim/clip.hpp"
#include "client/tools/sim/model_json.hpp"
#include "client/tools/sim/replay.hpp"
#include "client/tools/sim/replayed_world.hpp"
#include "client/tools/sim/stepper.hpp"
#include "client/tools/sim/trajectory_files.hpp"
#include "core/solver/node_terms.hpp"
#include "schema/wire/groom_file.hpp"
#include "tests/support/import_files.hpp"
#include "tests/support/levels.hpp"
#include "tests/support/npy_reader.hpp"

namespace hairnet::sim {
namespace {

// Makes a motion at 60 Hz of a head that nods by 0.4 rad about once a second and shifts to the side by 10 cm.
Motion nod(double duration_s = 1) {
  Motion motion;
  for (int i = 0; i <= 60 * duration_s; ++i) {
    const double angle = 0.4 * std::sin(6 * i / 60.0);
    motion.poses.push_back(
        rigid_pose({Quat(Eigen::AngleAxisd(angle, Vec3::UnitX())), Vec3(0.1 * std::sin(3 * i / 60.0), 1.6, 0)}));
  }
  return motion;
}

// Prepares a stepper that begins at the first pose of a clip, with 25 ticks a second. The level is random, since a
// solver must be right for any.
StepperDef stepper_def(const Clip& clip, int iterations = 16) {
  auto levels = std::make_shared<LevelSet>();
  levels->levels[0] = support::make_random_level();
  StepperDef def;
  def.levels = levels;
  def.tick_s = 1.0 / 25;
  def.iterations = iterations;
  def.start = clip.poses[0];
  return def;
}

double rms_mm(std::span<const Vec3f> a, std::span<const Vec3f> b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += double{(a[i] - b[i]).squaredNorm()};
  return 1e3 * std::sqrt(sum / static_cast<double>(a.size()));
}

// The arguments of make_clip() are the motion, ticks a second, and the seconds in which hair settles after the
// motion.
TEST(Clip, has_a_pose_for_the_start_and_one_a_tick) {
  const Clip clip = make_clip(nod(2), 25, 0);
  EXPECT_EQ(clip.tick_count(), 50u);
  EXPECT_EQ(clip.motion_tick_count, 50u);
}

TEST(Clip, settling_ends_upright_in_place_with_the_heading_kept) {
  Motion motion;
  const Quat yaw(Eigen::AngleAxisd(0.7, Vec3::UnitY()));
  motion.poses = {rigid_pose({yaw * Quat(Eigen::AngleAxisd(0.5, Vec3::UnitX())), Vec3(1, 2, 3)})};
  const Clip clip = make_clip(motion, 25, 2);
  EXPECT_EQ(clip.tick_count(), 50u);
  EXPECT_EQ(clip.motion_tick_count, 0u);
  for (const RigidTransform& bone : clip.poses.back().bones) {
    EXPECT_LT(bone.rotation.angularDistance(yaw), 1e-6);
    EXPECT_LT((bone.position - Vec3(1, 2, 3)).norm(), 1e-6);
  }
  // The head eases upright within 1 s, 25 ticks, and then stands (clip.cpp).
  EXPECT_EQ(clip.poses[25].head().position, clip.poses.back().head().position);
}

TEST(Clip, a_teleport_falls_on_the_tick_that_passes_it) {
  Motion motion = nod();
  motion.teleports.assign(motion.poses.size(), false);
  // Pose 31 is at 0.5167 s, in the tick from 0.48 to 0.52 s.
  motion.teleports[31] = true;
  const Clip clip = make_clip(motion, 25, 0);
  for (std::size_t i = 0; i < clip.teleports.size(); ++i) EXPECT_EQ(clip.teleports[i], i == 13) << i;
}

TEST(Stepper, the_world_with_many_iterations_follows_the_converged_solver) {
  const Clip clip = make_clip(nod(), 25, 0);
  for (const int substeps : {1, 3}) {
    // With 400 iterations the iterative solver must reach the converged one within 0.01 mm, while hair moves by more
    // than 1 mm.
    StepperDef def = stepper_def(clip, 400);
    def.substep_count = substeps;
    const auto world = make_stepper(Solver::standard, def), converged = make_stepper(Solver::converged, def);
    double motion_mm = 0;
    for (std::size_t i = 1; i < clip.poses.size(); ++i) {
      world->step(clip.poses[i], false);
      converged->step(clip.poses[i], false);
      const std::vector<Vec3f> rest(world->state().displacement.size(), Vec3f::Zero());
      motion_mm = std::max(motion_mm, rms_mm(world->state().displacement, rest));
      EXPECT_LT(rms_mm(world->state().displacement, converged->state().displacement), 0.01) << substeps << " " << i;
    }
    EXPECT_GT(motion_mm, 1);
  }
}

TEST(Stepper, a_teleport_moves_the_lattice_rigidly_with_either_solver) {
  const Clip clip = make_clip(nod(), 25, 0);
  for (const Solver solver : {Solver::standard, Solver::converged}) {
    const auto stepper = make_stepper(solver, stepper_def(clip));
    for (std::size_t i = 1; i < clip.poses.size(); ++i) stepper->step(clip.poses[i], false);
    const LatticeState before = stepper->state();
    const Pose far = rigid_pose({Quat(Eigen::AngleAxisd(2, Vec3::UnitY())), Vec3(5, 0, 0)});
    const StepReport report = stepper->step(far, true);
    EXPECT_EQ(report.teleports, 1u);
    // Without rigid motion the hair would be dragged over 5 m, and displacements would be metres.
    EXPECT_LT(rms_mm(stepper->state().displacement, before.displacement), 1e-3);
    // The hair keeps its velocity relative to the head, which had the velocity of the last substep before the jump.
    const StepperDef def = stepper_def(clip);
    const Pose& last = clip.poses.back();
    const double substep_s = def.tick_s / def.substep_count;
    const Pose from = interpolate(*std::prev(clip.poses.end(), 2), last, 1 - 1.0 / def.substep_count);
    std::vector<Vec3f> relative = before.velocity;
    const Level& level = (*def.levels)[def.level];
    for (std::size_t i = 0; i < relative.size(); ++i) {
      const Vec3 rest = level.rest[i].cast<double>();
      const Vec3 rigid = (last.head().point(rest) - from.head().point(rest)) / substep_s;
      relative[i] -= (last.head().rotation.inverse() * rigid).cast<float>();
    }
    // rms_mm() gives mm/s here.
    EXPECT_LT(rms_mm(stepper->state().velocity, relative), 1e-2);
  }
}

TEST(GridNodes, a_lattice_at_rest_moves_as_one_with_the_head) {
  const Level level = support::make_random_level();
  GridNodes nodes(level.geometry);
  const RigidTransform to{Quat(Eigen::AngleAxisd(0.2, Vec3::UnitY())), Vec3(1.1, 0, 0)};
  const std::vector<Vec3f> still(level.rest.size(), Vec3f::Zero());
  const std::span<const float> positions = nodes.positions(to, still);
  for (std::uint32_t n = 0; n < level.geometry.lattice.node_count(); ++n) {
    const Vec3 wanted = to.point(level.geometry.lattice.node(n).cast<double>());
    for (int a = 0; a < 3; ++a) EXPECT_NEAR(positions[3 * n + a], wanted[a], 1e-6);
  }
}

TEST(GridNodes, trimmed_nodes_follow_in_position_and_velocity) {
  // Half of the nodes are trimmed, and each follows its neighbour along x. A trimmed node has the displacement and the
  // own velocity of that neighbour.
  Level level = support::make_random_level();
  LevelGeometry& g = level.geometry;
  g.active_nodes.clear();
  g.trimmed_begin = {0};
  for (std::uint32_t n = 0; n < g.lattice.node_count(); ++n) {
    if (n % 2 == 0) {
      g.active_nodes.push_back(n);
      continue;
    }
    g.trimmed_nodes.push_back(n);
    g.trimmed_from.push_back(n / 2);
    g.trimmed_weights.push_back(1);
    g.trimmed_begin.push_back(static_cast<std::uint32_t>(g.trimmed_from.size()));
  }
  ASSERT_EQ(validate(g), "");
  GridNodes nodes(g);
  const RigidTransform from{Quat(Eigen::AngleAxisd(0.1, Vec3::UnitZ())), Vec3(0, 1, 0)};
  const RigidTransform to{Quat(Eigen::AngleAxisd(0.15, Vec3::UnitZ())), Vec3(0.2, 1, 0)};
  const double h = 0.04;
  // Active nodes have the velocity of their rest position in the moving head, plus `own`. Trimmed nodes must have the
  // velocity of their own rest position, plus `own`.
  const Vec3 own(0.3, -0.2, 0.1);
  std::vector<Vec3f> velocity_head;
  for (const std::uint32_t n : g.active_nodes) {
    const Vec3 p = g.lattice.node(n).cast<double>();
    const Vec3 world = (to.point(p) - from.point(p)) / h + own;
    velocity_head.push_back((to.rotation.conjugate() * world).cast<float>());
  }
  const std::span<const float> velocities = nodes.velocities(from, to, h, velocity_head);
  for (std::uint32_t n = 0; n < g.lattice.node_count(); ++n) {
    const Vec3 p = g.lattice.node(n).cast<double>();
    const Vec3 wanted = (to.point(p) - from.point(p)) / h + own;
    for (int a = 0; a < 3; ++a) EXPECT_NEAR(velocities[3 * n + a], wanted[a], 1e-4) << n;
  }
}

TEST(ModelJson, contains_every_field_and_reads_back_to_the_same_bits) {
  Level level = support::make_random_level();
  ModelDump dump;
  dump.level = &level;
  dump.rate_hz = 25;
  dump.substep_count = 2;
  dump.wind_m_per_s = Vec3(1, 0, 0.1);
  dump.resets = {7};
  const nlohmann::json json = nlohmann::json::parse(encode_model_json(dump));
  EXPECT_EQ(json["format"], "hairnet-model");
  EXPECT_EQ(json["version"], 2);
  EXPECT_EQ(json["rate_hz"], 25);
  EXPECT_EQ(json["substeps"], 2);
  EXPECT_EQ(json["bones"].size(), kBoneCount);
  EXPECT_EQ(json["resets"], nlohmann::json({7}));
  EXPECT_FALSE(json["notes"].empty());
  EXPECT_EQ(json["wind"][2].get<double>(), 0.1);
  EXPECT_EQ(json["nodes"]["active"].size(), level.rest.size());
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    EXPECT_EQ(json["nodes"]["mass"][i].get<float>(), level.mass[i]);
    EXPECT_EQ(json["nodes"]["ether_k"][i].get<float>(), level.ether_stiffness[i]);
    // The damping depends on the length of a substep: 25 ticks of 2 substeps a second make 1/50 s.
    EXPECT_EQ(json["nodes"]["ether_q"][i].get<float>(), ether_damping(level, {}, i, 1.0f / 50));
    EXPECT_EQ(json["nodes"]["drag"][i][5].get<float>(), level.drag[i][5]);
  }
  ASSERT_EQ(json["springs"].size(), level.springs.count());
  ASSERT_EQ(json["attachments"].size(), level.attachments.count());
  ASSERT_EQ(json["skin"].size(), level.skin->size());
  ASSERT_EQ(json["contacts"].size(), level.contacts.count());
  // Any spring, attachment, body part and contact point will do; these are not the first ones, so that an offset
  // shows.
  const auto& spring = json["springs"][3];
  for (std::size_t e = 0; e < spring["nodes"].size(); ++e) {
    const std::uint32_t entry = level.springs.begin[3] + static_cast<std::uint32_t>(e);
    EXPECT_EQ(spring["weights"][e].get<float>(), level.springs.weights[entry]);
    EXPECT_EQ(spring["nodes"][e], level.geometry.active_nodes[level.springs.nodes[entry]]);
  }
  EXPECT_EQ(spring["rest_length"].get<double>(), level.springs.rest[3].cast<double>().norm());
  EXPECT_EQ(json["attachments"][2]["rest"][1].get<float>(), level.attachments.rest[2].y());
  EXPECT_EQ(json["skin"][1]["bone"], "left_shoulder");
  EXPECT_EQ(json["skin"][1]["distance"].size(), (*level.skin)[1].distance.size());
  EXPECT_EQ(json["contacts"][1]["limit"].size(), level.skin->size());
  EXPECT_EQ(json["contacts"][1]["potential"].get<float>(), level.contacts.potential[1]);
}

class ReplayedTicks : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(replayed_.take(wire::RecordingHeader{})); }
  static wire::RecordedAdd rigid_character(std::uint64_t key) {
    wire::RecordedAdd added;
    added.character = key;
    return added;
  }
  // Expects the next tick to be refused with a text that contains `what`.
  void expect_refused(const wire::RecordedTick& tick, const std::string& what) {
    const Result<void> taken = replayed_.take(tick);
    ASSERT_FALSE(taken);
    EXPECT_NE(taken.error().find(what), std::string::npos) << taken.error();
  }
  // The callback gets the time and the text of progress, which these tests do not need.
  ReplayedWorld replayed_{[](double, std::string_view) {}};
};

TEST_F(ReplayedTicks, equal_hashes_are_accepted_and_others_refused) {
  World world(WorldDef{});
  CharacterDef def;
  ASSERT_TRUE(world.add(def));
  world.step();
  wire::RecordedTick tick;
  tick.added = {rigid_character(1)};
  tick.state_hash = world.hash();
  EXPECT_TRUE(replayed_.take(tick));
  tick.added.clear();
  tick.tick = 1;
  // One wrong bit stands for a machine that computes something else than the server did.
  tick.state_hash ^= 1;
  expect_refused(tick, "tick 1: the state differs");
}

// A damaged recording may name characters and grooms that it never adds. A replay must say so and not crash.
TEST_F(ReplayedTicks, refuses_what_the_recording_has_no_ground_for) {
  wire::RecordedTick tick;
  tick.removed = {5};
  expect_refused(tick, "removes unknown session 0 character 5");
  tick = {};
  tick.poses = {{5, false, Pose{}}};
  expect_refused(tick, "poses unknown");
  tick = {};
  tick.levels = {{5, LevelIndex::high}};
  expect_refused(tick, "unknown session 0 character 5");
  tick = {};
  tick.added = {rigid_character(1)};
  tick.added[0].levels_ready = true;
  expect_refused(tick, "a groom that is not in the recording");
  EXPECT_FALSE(replayed_.take(wire::RecordingHeader{}));
  EXPECT_FALSE(replayed_.take(wire::RecordedGroom{{1, 2, 3}}));
}

TEST_F(ReplayedTicks, refuses_a_tick_before_the_header) {
  ReplayedWorld empty([](double, std::string_view) {});
  EXPECT_FALSE(empty.take(wire::RecordedTick{}));
}

// Gives each test a folder of its own, and reads the Alembic files in it.
class StrandFiles : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  [[nodiscard]] std::string path(const char* name) const { return (folder_ / name).string(); }
  [[nodiscard]] StrandMotion motion(const char* name) const {
    auto motion = decode_alembic_motion(test::file_bytes(path(name)));
    EXPECT_TRUE(motion) << motion.error();
    return motion ? std::move(*motion) : StrandMotion();
  }
  static Groom short_hair() {
    HairstyleOptions options;
    options.strand_count = 40;
    return *make_hairstyle("short", options);
  }
  std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("strand_files_" + std::to_string(::getpid()));
};

TEST_F(StrandFiles, simulated_strands_are_those_of_the_array_of_points) {
  const Groom groom = short_hair();
  const Level level = support::make_random_level();
  SimulateOptions options;
  options.out = path("hair.abc");
  options.points = path("points.npy");
  options.rate_hz = 25;
  {
    auto files = TrajectoryFiles::create(options, groom, level, 3);
    ASSERT_TRUE(files) << files.error();
    std::mt19937 random(3);
    // The lattice of each row is random, since only the way from lattices to files is tested.
    const Motion motion = nod();
    for (std::size_t row = 0; row < 3; ++row) {
      LatticeState state;
      for (std::size_t n = 0; n < level.rest.size(); ++n)
        state.displacement.push_back(support::random_vec(random, 0.02f));
      files->add_row(motion.poses[10 * row], motion.poses[10 * row], 0.04, state);
    }
    ASSERT_TRUE(files->finish());
  }
  const StrandMotion strands = motion("hair.abc");
  const auto points = support::read_npy<float>(options.points);
  const ExportedStrands exported = exported_strands(groom);
  ASSERT_EQ(strands.times_s.size(), 3u);
  EXPECT_NEAR(strands.times_s[2], 2 / 25.0, 1e-9);
  for (std::size_t row = 0; row < 3; ++row) {
    std::vector<Vec3f> of_groom(groom.points.size()), wanted;
    std::copy_n(points.row(row), 3 * of_groom.size(), of_groom[0].data());
    exported.take_points(of_groom, wanted);
    EXPECT_EQ(strands.points[row], wanted) << row;
  }
}

TEST_F(StrandFiles, points_follow_another_lattice_at_once_and_none_is_rest) {
  const Groom groom = short_hair();
  support::RandomLevel small;
  // A character may change its level, and with it its lattice, between two frames.
  small.nodes_per_axis = 4;
  const Level level = support::make_random_level(), other = support::make_random_level(small);
  const RigidTransform head = nod().poses[20].head();
  const auto moved = [&](WorldPoints& points, const Level& of) {
    const std::span<const Vec3f> at =
        points.at(head, &of.geometry, std::vector<Vec3f>(of.rest.size(), Vec3f(0, 0.01f, 0)));
    return std::vector<Vec3f>(at.begin(), at.end());
  };
  WorldPoints points(groom), fresh(groom);
  moved(points, level);
  EXPECT_EQ(moved(points, other), moved(fresh, other));
  const std::span<const Vec3f> rest = points.at(head, nullptr, {});
  for (std::size_t i = 0; i < rest.size(); ++i)
    EXPECT_LT((rest[i].cast<double>() - head.point(groom.points[i].cast<double>())).norm(), 1e-6);
}

TEST_F(StrandFiles, replayed_strands_have_a_frame_for_each_tick_and_stand_still_where_ticks_are_missing) {
  const std::vector<std::uint8_t> groom_file = wire::encode_groom(short_hair());
  const Groom groom = *wire::decode_groom(groom_file);
  // Ticks 9 and 10 are missing in the recording, so the strands have five frames, and stand still in the third and
  // fourth.
  constexpr std::array<std::uint64_t, 3> kTicks{7, 8, 11};
  // A recording names characters by their session, here 5, and their number, here 2.
  constexpr std::uint64_t kCharacter = std::uint64_t{5} << 32 | 2;
  std::vector<Pose> poses;
  {
    std::ofstream file(path("server.rec"), std::ios::binary);
    const auto put = [&](const wire::RecordEntry& entry) {
      const std::vector<std::uint8_t> bytes = wire::encode_record_entry(entry);
      file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    };
    put(wire::RecordingHeader{});
    put(wire::RecordedGroom{groom_file});
    World world(WorldDef{});
    const CharacterId id = world.add(CharacterDef{});
    for (std::size_t i = 0; i < kTicks.size(); ++i) {
      poses.push_back(rounded_to_wire(nod().poses[5 * i]));
      wire::RecordedTick tick;
      tick.tick = kTicks[i];
      if (i == 0) {
        wire::RecordedAdd added;
        added.character = kCharacter;
        added.groom = wire::hash_groom(groom_file);
        tick.added = {added};
      }
      tick.poses = {{kCharacter, true, poses.back()}};
      world.set_pose(id, poses.back(), true);
      world.step();
      tick.state_hash = world.hash();
      put(tick);
    }
  }
  ReplayOptions options;
  options.recording = path("server.rec");
  options.out = path("hair.abc");
  options.character = 2;
  const Result<void> replayed = replay(options);
  ASSERT_TRUE(replayed) << replayed.error();
  const StrandMotion strands = motion("hair.abc");
  const ExportedStrands exported = exported_strands(groom);
  ASSERT_EQ(strands.times_s.size(), 5u);
  for (std::size_t f = 0; f < 5; ++f) {
    std::vector<Vec3f> moved = groom.points, wanted;
    const RigidTransform& head = poses[f < 4 ? std::min<std::size_t>(f, 1) : 2].head();
    for (Vec3f& x : moved) x = head.point(x.cast<double>()).cast<float>();
    exported.take_points(moved, wanted);
    ASSERT_EQ(strands.points[f].size(), wanted.size());
    for (std::size_t i = 0; i < wanted.size(); ++i)
      EXPECT_LT((strands.points[f][i] - wanted[i]).norm(), 1e-6f) << f << ' ' << i;
  }
  options.character = 3;
  const Result<void> missing = replay(options);
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error(), "character 3 is not in this recording");
}

}  // namespace
}  // namespace hairnet::sim
