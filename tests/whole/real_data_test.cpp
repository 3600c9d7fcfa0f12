#include <gmock/gmock.h>

#include <cstdio>
#include <filesystem>

#include "tests/whole/frame_comparison.hpp"
#include "tests/whole/whole_test.hpp"

namespace hairnet::whole {
namespace {

// Hairstyles and motions that people made, and whose files we only read.
class RealData : public WholeTest {
 protected:
  void SetUp() override {
    if (!std::filesystem::is_directory(HAIRNET_SHARED_DIR))
      GTEST_SKIP() << "NO REAL DATA: " << HAIRNET_SHARED_DIR << " is absent, nothing of this test was checked";
    WholeTest::SetUp();
  }
  static std::string data(const std::string& name) { return std::string(HAIRNET_SHARED_DIR) + "/" + name; }

  std::string import_groom(const std::string& name, const Arguments& more) {
    Arguments arguments{"import", "--out", path(name + ".groom")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    auto groom = start("hairnet-groom", arguments, "import_" + name);
    finish(*groom, 0);
    return path(name + ".groom");
  }
  std::string convert_clip(const std::string& name) {
    auto converter = start("hairnet-deepmimic-to-bvh",
                           {data("motion/deepmimic_humanoid3d_" + name + ".txt"), path(name + ".bvh")}, "clip_" + name);
    finish(*converter, 0);
    return path(name + ".bvh");
  }
};

TEST_F(RealData, four_hairstyles_dance_through_a_socket_and_come_to_rest_near_their_design) {
  const std::string straight = import_groom(
      "straight", {data("hair/yuksel_straight/straight.hair"), "--up", "+z", "--face", "+y", "--unit", "0.0033"});
  const std::string tail = "hair/amd_ponytail/";
  const std::string ponytail =
      import_groom("ponytail", {data(tail + "back.tfx"), data(tail + "front_top.tfx"), data(tail + "side.tfx"),
                                data(tail + "tail.tfx"), "--face", "-z", "--unit", "0.00254", "--body",
                                data("head/amd_ponytail_head_max4.obj"), "--body-face", "+z"});
  const std::string wavy = import_groom("wavy", {data("hair/harolongo/harolongo.data"), "--unit", "0.01", "--body",
                                                 data("head/digitalsalon_female_body_scaled.obj")});
  const std::string layered = import_groom(
      "layered", {data("hair/sintel/SintelHairOriginal-sintel_hair.16points.tfx"), "--body", data("head/sintel.obj")});

  auto server = start_server({"--record", path("recording")});
  auto view = start_view(
      {"--character", "groom=" + straight + ",motion=" + data("motion/cmu_scaled_131_01.bvh") + ",level=high",    //
       "--character", "groom=" + ponytail + ",motion=" + data("motion/cmu_scaled_131_02.bvh") + ",level=medium",  //
       "--character", "groom=" + wavy + ",motion=" + convert_clip("dance_a") + ",level=high",                     //
       "--character", "groom=" + layered + ",motion=" + convert_clip("spinkick") + ",level=low",                  //
       "--duration", "3", "--settle", "5", "--trace", path("received")});
  finish(*view, 0);
  std::fputs(view->out().c_str(), stdout);
  drain(*server);

  const std::map<std::int64_t, double> rms_mm = last_rms_mm(Trace(path("received")));
  EXPECT_EQ(rms_mm.size(), 4u);
  // Hair may rest elsewhere than designed: the last one's does, chin-length hair against a jaw, after a kick.
  for (const auto& [character, rms] : rms_mm) {
    const std::int64_t number = character & 0xffffffff;
    EXPECT_LT(rms, number == 4 ? 10 : 1) << "character " << number;
  }

  auto sim = start("hairnet-sim", {"--replay", path("recording"), "--trace", path("computed")}, "sim");
  finish(*sim, 0);
  expect_same_frames("received", "computed");
}

}  // namespace
}  // namespace hairnet::whole
