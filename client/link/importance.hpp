#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>

#include "schema/wire/messages.hpp"

namespace hairnet::link {

// How this client sees members, said to the server a few times a second at most, and only what has changed enough to
// matter. One thread.
class Importance {
 public:
  static constexpr std::int64_t kInterval_ns = 250'000'000;
  static constexpr float kChange = 0.1f;  // of the screen height, as a share, that is worth a word

  void report(std::span<const wire::MemberImportance> members);
  void forget(std::uint32_t member) { members_.erase(member); }
  void forget_all();
  void say_all_again();  // the server may have missed some

  // What is to be said now, if anything; and when something may be.
  std::optional<wire::ReportImportance> take(std::int64_t now_ns);
  [[nodiscard]] std::int64_t due_ns() const;

 private:
  struct Reported {
    wire::MemberImportance now, said;
    bool due = true;
  };
  std::map<std::uint32_t, Reported> members_;
  bool any_due_ = false;
  std::int64_t next_ns_ = 0;
};

}  // namespace hairnet::link
