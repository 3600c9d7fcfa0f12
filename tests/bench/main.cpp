#include <algorithm>
#include <cstdio>
#include <span>

#include "client/files/write_file.hpp"
#include "core/solver/crowd_step.hpp"
#include "tests/bench/accuracy_table.hpp"
#include "tests/bench/codec_table.hpp"
#include "tests/bench/crowd_table.hpp"
#include "tests/bench/ffd_table.hpp"
#include "tests/bench/instructions.hpp"
#include "tests/bench/isa.hpp"
#include "tests/bench/paper_table.hpp"
#include "tests/bench/touch_instructions.hpp"

namespace hairnet::bench {
namespace {

int fail(const std::string& reason) {
  std::fprintf(stderr, "hairnet-bench: %s\n", reason.c_str());
  return 1;
}

Json header_of(const Options& options) {
  return {{"cpu", cpu_model()},     {"isa", isa_in_use()},        {"threads", thread_count()},
          {"groom", options.groom}, {"motions", options.motions}, {"crowd_width", crowd_width()}};
}

void print_header(const Json& header) {
  std::printf("hairnet-bench: %s, %s threads; %s, a crowd is %s wide\n", header["cpu"].get<std::string>().c_str(),
              header["threads"].dump().c_str(), header["isa"].get<std::string>().c_str(),
              header["crowd_width"].dump().c_str());
  std::printf("%s in %s\n", header["groom"].get<std::string>().c_str(), header["motions"].dump().c_str());
}

Result<void> write(const std::string& path, const std::string& text) {
  if (path.empty()) return {};
  const auto written = write_file(path, std::as_bytes(std::span(text)));
  if (!written) return Refusal(path + ": " + written.error());
  return {};
}

int run(const Options& options) {
  if (const auto used = use_isa(options.isa); !used) return fail(used.error());
  const auto subject = load_subject(options);
  if (!subject) return fail(subject.error());
  if (options.callgrind == "touch") return count_touch_instructions(*subject, options);
  if (!options.callgrind.empty()) return count_instructions(*subject, options);

  const Json header = header_of(options);
  Report report(header);
  print_header(header);
  const auto wants = [&](Section section) { return std::ranges::count(options.sections, section) > 0; };
  if (wants(Section::paper)) measure_paper_table(*subject, options, report);
  if (wants(Section::ffd)) measure_ffd(*subject, report);
  if (wants(Section::accuracy)) measure_accuracy(*subject, options, report);
  if (wants(Section::crowd)) measure_crowds(*subject, options, report);
  if (wants(Section::codec)) measure_codec_table(*subject, options, report);

  int status = 0;
  for (const std::string& failure : report.failures()) status = fail("wrong: " + failure);
  if (const auto written = write(options.json, report.json().dump(1) + "\n"); !written) status = fail(written.error());
  if (const auto written = write(options.csv, report.csv()); !written) status = fail(written.error());
  return status;
}

}  // namespace
}  // namespace hairnet::bench

int main(int argc, char** argv) {
  const auto parsed = hairnet::bench::parse_options(argc, argv);
  if (const int* exit_code = std::get_if<int>(&parsed)) return *exit_code;
  return hairnet::bench::run(std::get<hairnet::bench::Options>(parsed));
}
