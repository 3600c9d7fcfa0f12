#include "server/threading/output_thread.hpp"

#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <string_view>
#include <thread>
#include <utility>

#include "core/assert.hpp"

namespace hairnet::server {
namespace {

// Another program may have made the shared descriptor non-blocking; then it is tried this often.
constexpr int kRetry_ms = 100;

// Returns what could not be written.
std::string_view write(int descriptor, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(descriptor, text.data(), text.size());
    if (written >= 0) {
      text.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno == EAGAIN) {
      pollfd look{descriptor, POLLOUT, 0};
      ::poll(&look, 1, kRetry_ms);
    } else if (errno != EINTR) {
      break;
    }
  }
  return text;
}

}  // namespace

struct OutputThread::State {
  explicit State(OutputThreadDef given) : def(std::move(given)) {}

  // Call it with the lock held.
  void lose(std::uint64_t count) {
    lost += count;
    if (!is_over && def.on_lost) def.on_lost(count);
  }
  // On the thread alone. False when not all could be written.
  bool write_whole(const std::string& text) {
    // A text that was cut gets its line's end first, or the next line would be read as a part of it.
    if (is_cut && !write(def.descriptor, "\n").empty()) return false;
    is_cut = false;
    const std::string_view left = write(def.descriptor, text);
    is_cut = !left.empty() && left.size() < text.size();
    return left.empty();
  }
  void run() {
    std::unique_lock lock(mutex);
    while (true) {
      changed.wait(lock, [this] { return !waiting.empty() || is_over; });
      if (is_over) return;
      std::string text = std::move(waiting.front());
      waiting.pop_front();
      bytes -= text.size();
      // The lost texts were older than this one, so they are told of before it.
      const std::uint64_t gap = std::exchange(lost, 0);
      is_writing = true;
      // A write may block for any time. Callers of put() must not wait for it.
      lock.unlock();
      const bool is_announced = gap == 0 || !def.lost_text || write_whole(def.lost_text(gap));
      const bool is_written = is_announced && write_whole(text);
      lock.lock();
      is_writing = false;
      // The lost texts were counted already; only their report is still missing.
      if (!is_announced) lost += gap;
      if (!is_written) lose(1);
      changed.notify_all();
    }
  }

  const OutputThreadDef def;
  std::mutex mutex;
  std::condition_variable changed;
  std::deque<std::string> waiting;
  // The bytes of all texts in `waiting`.
  std::size_t bytes = 0;
  // The number of texts that are lost and not reported by lost_text() yet.
  std::uint64_t lost = 0;
  bool is_writing = false, is_over = false;
  // The last text was written in part only, as on a full disk.
  bool is_cut = false;
};

OutputThread::OutputThread(OutputThreadDef def) : state_(std::make_shared<State>(std::move(def))) {
  HAIRNET_ASSERT(state_->def.descriptor >= 0);
  // A thread that blocks in a write cannot be joined, so it shares the state and may outlive the object.
  std::thread([state = state_] { state->run(); }).detach();
}

OutputThread::~OutputThread() {
  finish(std::chrono::steady_clock::now());
}

void OutputThread::put(std::string text) {
  const std::lock_guard lock(state_->mutex);
  if (state_->is_over) return;
  state_->bytes += text.size();
  state_->waiting.push_back(std::move(text));
  // The oldest texts go: what happens now is worth more to a reader.
  while (state_->bytes > state_->def.bytes_max) {
    state_->bytes -= state_->waiting.front().size();
    state_->waiting.pop_front();
    state_->lose(1);
  }
  state_->changed.notify_all();
}

void OutputThread::lose() {
  const std::lock_guard lock(state_->mutex);
  state_->lose(1);
}

void OutputThread::finish(std::chrono::steady_clock::time_point until) {
  std::unique_lock lock(state_->mutex);
  state_->changed.wait_until(lock, until, [this] { return state_->waiting.empty() && !state_->is_writing; });
  state_->is_over = true;
  state_->waiting.clear();
  state_->bytes = 0;
  state_->changed.notify_all();
}

}  // namespace hairnet::server
