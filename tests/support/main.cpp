#include <gmock/gmock.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <string_view>

// The tests of the whole project must stay quick: in a release build a case fails that takes more processor time than
// kMost_s, with the programs that it ran, unless it is listed here. Other work on the machine hardly changes this time.
namespace {

constexpr double kMost_s = 20;

// Why each of these takes longer is in tests/README.md.
constexpr std::string_view kLongCases[] = {
    "-",
};

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

double processor_time_s() {
  double sum = 0;
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
  testing::InitGoogleMock(&argc, argv);
#if defined(NDEBUG) && !HAIRNET_SANITIZED
  testing::UnitTest::GetInstance()->listeners().Append(new ProcessorTime);
#endif
  return RUN_ALL_TESTS();
}
