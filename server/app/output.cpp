#include "server/app/output.hpp"

#include <fmt/format.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/sinks/null_sink.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <chrono>
#include <memory>
#include <mutex>
#include <utility>

namespace hairnet::server {
namespace {

// At the end, readers have this long to take what waits.
constexpr std::chrono::seconds kPatience{2};
// The form of a log line: spdlog's pattern with time, level and the text.
constexpr const char* kPattern = "time=%Y-%m-%dT%H:%M:%S.%eZ level=%l %v";

std::unique_ptr<spdlog::formatter> make_formatter() {
  return std::make_unique<spdlog::pattern_formatter>(kPattern, spdlog::pattern_time_type::utc);
}

std::string text_of(spdlog::formatter& formatter, const spdlog::details::log_msg& message) {
  spdlog::memory_buf_t line;
  formatter.format(message, line);
  return {line.data(), line.size()};
}

// spdlog's own sinks write on the thread that logs, so a reader who stalls would block that thread.
class QueueSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  explicit QueueSink(OutputThread& to) : base_sink(make_formatter()), to_(&to) {}

 private:
  void sink_it_(const spdlog::details::log_msg& message) override { to_->put(text_of(*formatter_, message)); }
  void flush_() override {}

  OutputThread* to_;
};

// The settings of the log's thread: standard error, with a count of lost lines.
OutputThreadDef log_def(ProgramCounters& counters) {
  OutputThreadDef def;
  def.descriptor = STDERR_FILENO;
  def.on_lost = [&counters](std::uint64_t count) { counters.log_lines_dropped.add(count); };
  // A line about lost lines stands where they are missing, in the same format.
  def.lost_text = [formatter = std::shared_ptr(make_formatter())](std::uint64_t count) {
    const std::string text = fmt::format("event=log_lines_dropped count={}", count);
    return text_of(*formatter, spdlog::details::log_msg("hairnet", spdlog::level::warn, text));
  };
  return def;
}

}  // namespace

Output::Output(const std::string& log_level, ProgramCounters& counters)
    : log_(log_def(counters)), out_({.descriptor = STDOUT_FILENO}) {
  auto logger = std::make_shared<spdlog::logger>("hairnet", std::make_shared<QueueSink>(log_));
  logger->set_level(spdlog::level::from_str(log_level));
  // An error of spdlog counts as a lost line. spdlog would print it to standard error, which could block.
  logger->set_error_handler([this](const std::string&) { log_.lose(); });
  spdlog::set_default_logger(std::move(logger));
}

Output::~Output() {
  // The logger goes first: a thread that still logs must not meet a queue that has ended.
  spdlog::set_default_logger(
      std::make_shared<spdlog::logger>("hairnet", std::make_shared<spdlog::sinks::null_sink_mt>()));
  const auto until = std::chrono::steady_clock::now() + kPatience;
  log_.finish(until);
  out_.finish(until);
}

}  // namespace hairnet::server
