#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>

#include "schema/wire/messages.hpp"

namespace hairnet::link {

// Reports to the server how large each member is on this client's screen: at most four times a second, and only for
// members whose size or visibility has changed enough to matter. One thread.
class ImportanceReporter {
 public:
  static constexpr std::int64_t kInterval_ns = 250'000'000;
  // A change of the screen height by this share of the larger height is worth a report.
  static constexpr float kChange = 0.1f;

  void report(std::span<const wire::MemberImportance> members);
  // The member has left. Another member may get its number, for which the server would use the old report. So the next
  // report sets the number back to the value of members that were never reported.
  void forget(std::uint32_t member);
  void forget_all();
  // Marks every member as due, after a reconnect.
  void resend_all();

  // take() returns the report to send now, if any; due_ns() is the earliest time of the next one.
  std::optional<wire::ReportImportance> take(std::int64_t now_ns);
  [[nodiscard]] std::int64_t due_ns() const;

 private:
  struct Reported {
    // The newest value, and the one in the last message to the server.
    wire::MemberImportance now, sent;
    bool due = true, is_sent = false, has_left = false;
  };
  std::map<std::uint32_t, Reported> members_;
  bool any_due_ = false;
  std::int64_t next_ns_ = 0;
};

}  // namespace hairnet::link
