#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace hairnet::server {

struct OutputThreadDef {
  // Must stay open; the thread does not close it.
  int descriptor = -1;
  // Bounds the text that waits; beyond it the oldest is lost.
  std::size_t bytes_max = std::size_t{1} << 20;
  // Gets the number of lost texts. Any thread; must not put more.
  std::function<void(std::uint64_t)> on_lost = {};
  // Makes the text that is written in the place of this number of lost texts, once texts are written again. It is
  // called on the output's thread.
  std::function<std::string(std::uint64_t)> lost_text = {};
};

// Writes texts to a descriptor on a thread of its own. So a reader who stalls, a pipe without a reader or a full disk
// holds up nobody: text that cannot be written is counted as lost. The program must ignore SIGPIPE.
class OutputThread {
 public:
  explicit OutputThread(OutputThreadDef def);
  // Leaves what finish() has not written.
  ~OutputThread();
  OutputThread(const OutputThread&) = delete;
  OutputThread& operator=(const OutputThread&) = delete;

  // Never waits for the reader. Any thread.
  void put(std::string text);
  // Counts a text that could not even be put. Any thread.
  void lose();
  // Waits until all is written or lost, but no longer than that. What is left then is lost; a write that blocks goes on
  // until the process ends. Later texts are lost too.
  void finish(std::chrono::steady_clock::time_point until);

 private:
  struct State;
  // The thread shares the state, because it may outlive this object in a write that blocks.
  std::shared_ptr<State> state_;
};

}  // namespace hairnet::server
