#include "tests/whole/etcd_line.hpp"

#include <algorithm>
#include <utility>

namespace hairnet::whole {

void EtcdLine::keep_time() {
  timeline->after(10 * kMs, [this] {
    if (!etcd.is_down()) etcd.advance(now_ns());
    keep_time();
  });
}

void EtcdLine::put_bad_value(const std::string& key, std::int64_t end_ns, Random& random) {
  // An empty value, JSON without fields, a text that names no server, one byte more than a value may have, and as much
  // as an answer.
  const std::string values[] = {"", "{}", "nobody", std::string(server::etcd::kValueBytesMax + 1, 'x'),
                                std::string(kAnswerBytesMax, 'x')};
  const std::string& value = values[random.next() % std::size(values)];
  etcd.put(key, value);
  timeline->at(end_ns, [this, key, value] {
    if (etcd.value(key) == value) etcd.remove(key);
  });
}

EtcdLineEnd::EtcdLineEnd(EtcdLine& line, std::function<std::int64_t()> own_ns, std::uint64_t seed)
    : line_(&line), own_ns_(std::move(own_ns)), random_(seed) {}

EtcdLineEnd::~EtcdLineEnd() {
  *alive_ = false;
  for (const auto& [call, stream] : streams_) line_->etcd.end_watch(stream.watch);
}

std::int64_t EtcdLineEnd::delay() {
  // A message takes 0.2 to 3 ms, as within a data centre.
  double delay_ms = random_.between(0.2, 3);
  if (random_.unit() < line_->slow) delay_ms += random_.unit() * static_cast<double>(line_->slow_ns) * 1e-6;
  return static_cast<std::int64_t>(delay_ms * 1e6);
}

// Damages the share `damaged` of the answers: half of these are cut short, and the others have a brace behind them.
std::string EtcdLineEnd::corrupt(std::string text) {
  if (random_.unit() >= line_->damaged) return text;
  if (random_.unit() < 0.5) return text + "}";
  text.resize(random_.next() % text.size());
  return text;
}

bool EtcdLineEnd::is_reached(std::size_t endpoint) const {
  return cut_ != LineCut::both && !line_->etcd.is_down() && !line_->dead_members.contains(endpoint);
}

// The request may get lost, be refused, or arrive later.
void EtcdLineEnd::send(server::EtcdCall call) {
  open_.insert(call.id);
  if (cut_ == LineCut::requests) return;
  if (!is_reached(call.endpoint)) return refuse(call.id);
  if (random_.unit() < line_->loss) return;
  line_->timeline->after(delay(), [this, alive = alive_, call = std::move(call)]() mutable {
    if (*alive) arrive(std::move(call));
  });
}

void EtcdLineEnd::refuse(std::uint64_t call) {
  if (line_->is_silent || cut_ == LineCut::answers) return;
  deliver(call, line_->timeline->now_ns() + kMs, [this, call] {
    open_.erase(call);
    sink_->on_error(call, server::EtcdError::unreachable, own_ns_());
  });
}

void EtcdLineEnd::arrive(server::EtcdCall call) {
  if (cut_ == LineCut::requests) return;
  if (!is_reached(call.endpoint)) return refuse(call.id);
  if (call.is_stream) return open_stream(call);
  const auto answer = line_->etcd.handle(call.path, call.body, line_->now_ns());
  if (random_.unit() < line_->loss) return;
  const int times = random_.unit() < line_->repeated ? 2 : 1;
  deliver(call.id, line_->timeline->now_ns() + delay() + late_ns_,
          [this, id = call.id, status = answer.status, body = corrupt(answer.body), times] {
            if (loses_answers()) return;
            open_.erase(id);
            if (body.size() > EtcdLine::kAnswerBytesMax)
              return sink_->on_error(id, server::EtcdError::oversize, own_ns_());
            for (int n = 0; n < times; ++n) sink_->on_answer(id, status, body, own_ns_());
          });
}

// A watch stays open, and each change is a line. After a line that is lost nothing more may come, or the gap would look
// like a complete list, so the whole stream is dead from then on. This happens 20 times less often than the loss of a
// call.
void EtcdLineEnd::open_stream(const server::EtcdCall& call) {
  if (!open_.contains(call.id)) return;
  streams_[call.id] = {};
  const std::uint64_t watch = line_->etcd.watch(call.body, [this, alive = alive_, id = call.id](std::string text) {
    if (!*alive || !streams_.contains(id)) return;
    Stream& stream = streams_.at(id);
    if (cut_ == LineCut::answers || random_.unit() < line_->loss / 20) stream.is_dead = true;
    if (stream.is_dead) return;
    stream.last_ns = std::max(stream.last_ns + 1, line_->timeline->now_ns() + delay() + late_ns_);
    const int times = random_.unit() < line_->repeated ? 2 : 1;
    deliver(id, stream.last_ns, [this, id, line = corrupt(std::move(text)), times] {
      if (line.size() > EtcdLine::kAnswerBytesMax) {
        cancel(id);
        return sink_->on_error(id, server::EtcdError::oversize, own_ns_());
      }
      for (int n = 0; n < times; ++n) {
        const auto found = streams_.find(id);
        if (found != streams_.end() && !found->second.is_dead) sink_->on_line(id, line, own_ns_());
      }
    });
  });
  streams_[call.id].watch = watch;
}

// Runs `action` at `at_ns`, unless the call was cancelled before; for a paused server, when it runs again.
void EtcdLineEnd::deliver(std::uint64_t call, std::int64_t at_ns, std::function<void()> action) {
  const auto act = [this, call, action = std::move(action)] {
    if (!open_.contains(call)) return;
    action();
    if (on_delivered) on_delivered();
  };
  line_->timeline->at(at_ns, [this, alive = alive_, act] {
    if (!*alive) return;
    if (is_paused_)
      waiting_.push_back(act);
    else
      act();
  });
}

void EtcdLineEnd::cancel(std::uint64_t call) {
  open_.erase(call);
  if (const auto stream = streams_.find(call); stream != streams_.end()) {
    line_->etcd.end_watch(stream->second.watch);
    streams_.erase(stream);
  }
}

void EtcdLineEnd::resume() {
  is_paused_ = false;
  for (const auto& action : std::exchange(waiting_, {})) action();
}

void EtcdLineEnd::cut(LineCut cut) {
  cut_ = cut;
  if (cut == LineCut::both) break_streams();
  if (cut != LineCut::answers) return;
  for (auto& [call, stream] : streams_) stream.is_dead = true;
}

void EtcdLineEnd::break_streams() {
  for (auto& [call, stream] : streams_) {
    stream.is_dead = true;
    const std::uint64_t id = call;
    if (!line_->is_silent && cut_ != LineCut::answers)
      deliver(id, line_->timeline->now_ns() + kMs, [this, id] {
        cancel(id);
        sink_->on_error(id, server::EtcdError::broken, own_ns_());
      });
  }
}

}  // namespace hairnet::whole
