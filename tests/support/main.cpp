#include <gmock/gmock.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <string_view>

#include "core/broken_pipe.hpp"

// The tests of the whole project must stay quick: in a release build a case fails that takes more processor time than
// kMost_s, with the programs that it ran, unless it is listed here. Other work on the machine hardly changes this time.
namespace {

constexpr double kMost_s = 20;

// These take longer, or come so near to it that a slower machine exceeds it. tests/README.md says why most of them do.
constexpr std::string_view kLongCases[] = {
    "RealData.four_hairstyles_dance_through_a_socket_and_come_to_rest_near_their_design",
    "BuildLevels.can_be_cancelled_at_every_call",
    "RealEtcd.a_server_that_is_short_of_time_hands_rooms_over_to_one_that_joins",
    "Replay.a_damaged_recording_has_a_plain_reason",
    "Replay.every_received_frame_is_what_the_recording_computes_again",
    "WholeSeeds.a_server_and_its_clients_recover_from_all_disturbances",
    "Replay.hair_of_other_materials_in_a_storm_is_computed_again_as_well",
    "ObjectStoreTest.wrong_bytes_in_the_store_are_refused_and_the_groom_is_uploaded_built_and_put_right",
    "Datagrams.of_clients_whose_address_changes_belong_to_the_same_session",
    "LearntGroom.has_the_same_bits_for_any_order_of_work",
    "LearntGroom.is_valid_and_errs_less_than_the_low_level",
    "BuildEstimate.bounds_springs_and_memory_of_made_hairstyles",
    "PictureTest.follows_hair",
    "PictureTest.follows_heads",
    "PictureTest.follows_the_camera",
    "PictureTest.after_a_cut_is_the_single_picture",
    "Hair/PictureOfHair.of_which_16_have_less_than_a_quarter_of_the_grain_of_one/dark_curls",
};

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

double processor_time_s() {
  double sum = 0;
  // The children are the programs that a case has run and waited for.
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    getrusage(who, &usage);
    sum += seconds(usage.ru_utime) + seconds(usage.ru_stime);
  }
  return sum;
}

class ProcessorTime : public testing::EmptyTestEventListener {
  // The first case of a suite pays for what all its cases share.
  void OnTestSuiteStart(const testing::TestSuite&) override { begin_s_ = processor_time_s(); }
  void OnTestEnd(const testing::TestInfo& info) override {
    const double end_s = processor_time_s(), taken_s = end_s - begin_s_;
    begin_s_ = end_s;
    const std::string name = std::string(info.test_suite_name()) + '.' + info.name();
    if (taken_s > 1) std::printf("[          ] %s took %.1f s of processor time\n", name.c_str(), taken_s);
    if (taken_s > kMost_s && std::ranges::find(kLongCases, name) == std::end(kLongCases))
      ADD_FAILURE() << name << " took " << taken_s << " s of processor time; a case may take " << kMost_s;
  }
  double begin_s_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  hairnet::ignore_broken_pipes();
  testing::InitGoogleMock(&argc, argv);
#if defined(NDEBUG) && !HAIRNET_SANITIZED
  testing::UnitTest::GetInstance()->listeners().Append(new ProcessorTime);
#endif
  return RUN_ALL_TESTS();
}
