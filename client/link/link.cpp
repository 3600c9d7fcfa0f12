#include "client/link/link.hpp"

#include <algorithm>
#include <boost/asio.hpp>
#include <chrono>
#include <future>
#include <mutex>
#include <random>
#include <thread>
#include <utility>

#include "client/link/server_stream.hpp"
#include "core/assert.hpp"
#include "schema/channel/monotonic_clock.hpp"

namespace hairnet::link {
namespace {

using boost::system::error_code;
using std::chrono::milliseconds;

// A destructor waits for the goodbye to leave, but no longer than this: the server ends the session by itself later.
constexpr milliseconds kDestructionWait_max{600};
// Packets of a byte stream are gathered into one write up to this size, which saves system calls. A larger write would
// keep newer poses waiting behind it.
constexpr std::size_t kWriteBytesMax = 64u << 10;

std::uint64_t draw_trace() {
  std::random_device device;
  // The number 0 means that no trace was drawn.
  return std::uniform_int_distribution<std::uint64_t>(1)(device);
}

// Where WebTransport is tried first, the address's own transport has its full time after that.
LinkCoreOptions core_options(const LinkOptions& options) {
  LinkCoreOptions core = options.core;
  if (options.transport == TransportChoice::automatic)
    core.connect_timeout_s += std::chrono::duration<double>(kWebTransportWait).count();
  if (core.trace == 0) core.trace = draw_trace();
  return core;
}

}  // namespace

// `mutex` guards the core and what is said of the transport, which both threads use; the rest belongs to the I/O
// thread.
struct Link::Impl {
  // One attempt at a connection, and what came of it.
  struct Connection {
    std::shared_ptr<ServerStream> stream;
    // transmit() waits on it when there is nothing to write.
    asio::steady_timer wake;
    bool half_closed = false;
    // The core knows that the connection has ended, or has dropped it.
    bool over = false;
  };

  explicit Impl(LinkOptions o) : options(std::move(o)), core(core_options(options)), thread([this] { io.run(); }) {
    // The thread is the last member, so all that watch() uses exists when it runs.
    asio::post(io, [this] { asio::co_spawn(io, watch(), asio::detached); });
  }

  ~Impl() {
    // Asks for a goodbye, and waits for it, but not too long. Then the I/O thread is stopped, with all that is pending.
    leave();
    ended_future.wait_for(kDestructionWait_max);
    work.reset();
    io.stop();
    thread.join();
  }

  // Runs `use` with the core under the mutex. `use` must not wait, since the other thread may need the core meanwhile.
  template <class Use>
  auto with_core(Use use) const {
    const std::lock_guard lock(mutex);
    return use(core);
  }
  // The same for calls that change the core.
  template <class Use>
  auto with_core(Use use) {
    const std::lock_guard lock(mutex);
    return use(core);
  }
  // Changes the core on the caller's thread, and wakes the I/O thread, which does what the core then wants.
  template <class Use>
  void ask(Use use) {
    with_core(use);
    asio::post(io, [this] { look_again(); });
  }
  // Wakes watch() and transmit(), which run on the I/O thread, as this function does. If one of them is not waiting but
  // writing, it asks the core again after the write. So no wake-up can get lost.
  void look_again() {
    wake.cancel();
    if (current) current->wake.cancel();
  }

  // Calls turn() whenever something has happened or a deadline has come, as long as the link exists.
  asio::awaitable<void> watch() {
    while (true) {
      const std::int64_t deadline_ns = turn(channel::monotonic_ns());
      error_code ignored;
      // Waits are short enough for any clock arithmetic.
      wake.expires_after(
          std::chrono::nanoseconds(std::clamp<std::int64_t>(deadline_ns - channel::monotonic_ns(), 0, kWait_ns_max)));
      co_await wake.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
    }
  }

  // Does what the core wants at this time. Returns the time of the next call.
  std::int64_t turn(std::int64_t now_ns) {
    const std::lock_guard lock(mutex);
    core.poll(now_ns);
    // The old connection goes before a new one is made, as `current` holds one only.
    if (core.wants_close()) drop(now_ns);
    // A time-out may have given the writer something to send, such as a sign of life.
    if (current) current->wake.cancel();
    if (core.wants_connection()) {
      core.on_opening(now_ns);
      current = std::make_shared<Connection>(Connection{make_stream(), asio::steady_timer(io)});
      asio::co_spawn(io, connect(current), asio::detached);
    }
    if (core.welcome()) answer_with(*core.welcome());
    if (core.ended() && !std::exchange(ended, true)) {
      answer_with(Refusal(core.end_detail()));
      ended_promise.set_value();
    }
    return core.next_deadline_ns();
  }

  std::shared_ptr<ServerStream> make_stream() {
    StreamOptions stream{options.server, options.tls};
    if (const std::optional<wire::ServerAt>& to = core.redirected_to()) {
      stream.server.host = to->host;
      stream.server.port = to->port;
    }
    if (options.transport == TransportChoice::address) return make_server_stream(io, std::move(stream));
    if (options.transport == TransportChoice::webtransport) return make_web_transport_stream(io, std::move(stream));
    return make_fallback_stream(io, std::move(stream), fallback_memory);
  }

  // Ends the current connection. The caller must hold the mutex.
  void drop(std::int64_t now_ns) {
    HAIRNET_ASSERT(current);
    current->over = true;
    current->stream->close();
    current->wake.cancel();
    current.reset();
    transport = fallback_reason = {};
    core.on_closed("", now_ns);
  }

  // Opens the connection and begins the conversation over it. Then waits for a better transport to move to, where there
  // may be one.
  asio::awaitable<void> connect(std::shared_ptr<Connection> c) {
    std::string error = co_await c->stream->open();
    // The core may have dropped this connection while it was opening, and may already have another one.
    if (c->over) {
      c->stream->close();
      co_return;
    }
    if (!error.empty()) co_return end(c, std::move(error));
    talk_over(c);
    // A better stream is moved to by resuming the session, which a link that does not reconnect must not do.
    while (options.core.reconnect) {
      const std::shared_ptr<ServerStream> better = co_await c->stream->better();
      if (!better) break;
      move_to(better, c);
    }
  }

  // Begins the conversation over a connection whose stream is open.
  void talk_over(const std::shared_ptr<Connection>& c) {
    with_core([&](LinkCore& k) {
      transport = c->stream->transport();
      fallback_reason = c->stream->fallback_reason();
      k.on_open(channel::monotonic_ns(), c->stream->has_datagrams());
    });
    asio::co_spawn(io, receive(c), asio::detached);
    asio::co_spawn(io, transmit(c), asio::detached);
  }

  // Moves the session to another open stream, if there is a session that may move.
  void move_to(std::shared_ptr<ServerStream> stream, const std::shared_ptr<Connection>& from) {
    const std::int64_t now_ns = channel::monotonic_ns();
    // The core decides and the old connection goes under one lock, so that the caller's thread never sees a state
    // between them.
    const bool moves = !from->over && with_core([&](LinkCore& k) {
      if (!k.replace_connection("WebTransport is available now", now_ns)) return false;
      drop(now_ns);
      k.on_opening(now_ns);
      return true;
    });
    if (!moves) return stream->close();
    current = std::make_shared<Connection>(Connection{std::move(stream), asio::steady_timer(io)});
    talk_over(current);
  }

  // Passes what arrives to the core, until the connection ends.
  asio::awaitable<void> receive(std::shared_ptr<Connection> c) {
    while (true) {
      ServerStream::Read read = co_await c->stream->read();
      // The core has dropped this connection while the read was pending, and must not get its bytes.
      if (c->over) co_return;
      if (!read.error.empty()) co_return end(c, std::move(read.error));
      take(read.bytes, read.is_packet);
      look_again();
    }
  }

  // The stream has ended, or was not to be opened.
  void end(const std::shared_ptr<Connection>& c, std::string error) {
    c->over = true;
    c->stream->close();
    c->wake.cancel();
    current.reset();
    with_core([&](LinkCore& k) {
      transport = fallback_reason = {};
      k.on_closed(std::move(error), channel::monotonic_ns());
    });
    look_again();
  }

  void take(std::span<const std::uint8_t> bytes, bool is_packet) {
    const std::lock_guard lock(mutex);
    if (is_packet)
      core.on_packet(bytes, channel::monotonic_ns());
    else
      core.on_bytes(bytes, channel::monotonic_ns());
  }

  // Sends the core's packets, until the connection ends.
  asio::awaitable<void> transmit(std::shared_ptr<Connection> c) {
    std::vector<std::uint8_t> bytes;
    while (!c->over) {
      // Only one write is pending at a time, so back-pressure of the stream leaves packets in the core, whose queues
      // drop the oldest poses.
      const bool may_be_lost = gather(bytes, c->stream->has_messages());
      if (!bytes.empty()) {
        if (!co_await c->stream->write(bytes, may_be_lost)) co_return;
        continue;
      }
      if (!c->half_closed && with_core([](const LinkCore& k) { return k.wants_half_close(); })) {
        c->half_closed = true;
        c->stream->half_close();
      }
      error_code ignored;
      // There is nothing to send: waits until look_again() or turn() cancels the timer.
      c->wake.expires_after(std::chrono::nanoseconds(kWait_ns_max));
      co_await c->wake.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
    }
  }

  // Fills `bytes` with one packet, or for a byte stream with as many as make one good write. Returns whether they may
  // be lost.
  bool gather(std::vector<std::uint8_t>& bytes, bool is_message) {
    const std::lock_guard lock(mutex);
    // The packet is made at the last moment: the newest poses are in it, and its clock is that of sending.
    bytes = core.take_packet(channel::monotonic_ns());
    while (!is_message && !bytes.empty() && bytes.size() < kWriteBytesMax) {
      const std::vector<std::uint8_t> more = core.take_packet(channel::monotonic_ns());
      if (more.empty()) break;
      bytes.insert(bytes.end(), more.begin(), more.end());
    }
    return core.taken_may_be_lost();
  }

  void leave() {
    ask([](LinkCore& k) { k.leave(channel::monotonic_ns()); });
  }

  void answer_with(Result<wire::Welcome> welcome) {
    // Only the first welcome or end answers connect(); what comes after it is an event.
    if (!std::exchange(answered, true)) answer.set_value(std::move(welcome));
  }

  // The longest wait of a timer, an hour: a time-out of "never" would overflow Asio's clock.
  static constexpr std::int64_t kWait_ns_max = 3'600'000'000'000;

  const LinkOptions options;
  mutable std::mutex mutex;
  LinkCore core;
  // Both describe the open connection, for Link::transport() and Link::fallback_reason(); empty without one.
  std::string transport, fallback_reason;
  asio::io_context io;
  // The guard keeps io.run() going while nothing is pending.
  asio::executor_work_guard<asio::io_context::executor_type> work = asio::make_work_guard(io);
  // watch() waits on this timer.
  asio::steady_timer wake{io};
  // The connection that the core knows; null: none. Coroutines share it, so it outlives its replacement.
  std::shared_ptr<Connection> current;
  const std::shared_ptr<FallbackMemory> fallback_memory =
      std::make_shared<FallbackMemory>(FallbackMemory{options.blocked_for});
  // answered: `answer` has its value. ended: ended_promise has been set.
  bool answered = false, ended = false;
  std::promise<Result<wire::Welcome>> answer;
  std::promise<void> ended_promise;
  std::future<void> ended_future = ended_promise.get_future();
  // Only the caller's thread uses it.
  bool connect_called = false;
  // The thread is the last member, because it uses all members above.
  std::thread thread;
};

Link::Link(LinkOptions options) : impl_(std::make_unique<Impl>(std::move(options))) {}
Link::~Link() = default;

Result<wire::Welcome> Link::connect() {
  // The answer is a promise, which can be given once.
  if (std::exchange(impl_->connect_called, true)) return Refusal("connect() was called before");
  std::future<Result<wire::Welcome>> answer = impl_->answer.get_future();
  impl_->ask([](LinkCore& core) { core.start(); });
  return answer.get();
}

void Link::offer_groom(const wire::GroomHash& hash, RequestedState::Bytes bytes) {
  impl_->ask([&](LinkCore& core) { core.offer_groom(hash, std::move(bytes)); });
}

void Link::send(wire::ClientMessage message) {
  impl_->ask([&](LinkCore& core) { core.send(std::move(message)); });
}

void Link::report_importance(const std::vector<wire::MemberImportance>& members) {
  impl_->ask([&](LinkCore& core) { core.report_importance(members); });
}

void Link::request_groom(const wire::GroomHash& hash) {
  impl_->ask([&](LinkCore& core) { core.request_groom(hash); });
}

void Link::push_poses(std::vector<wire::PoseSample> poses) {
  impl_->ask([&](LinkCore& core) { core.push_poses(std::move(poses)); });
}

void Link::push_hands(std::vector<Hand> hands) {
  impl_->ask([&](LinkCore& core) { core.push_hands(std::move(hands), channel::monotonic_ns()); });
}

std::vector<Event> Link::poll() {
  return impl_->with_core([](LinkCore& core) { return core.take_events(); });
}

std::int64_t Link::now_ns() const {
  return channel::monotonic_ns();
}

std::int64_t Link::to_local_ns(std::int64_t server_time_ns) const {
  return impl_->with_core([&](const LinkCore& core) { return core.to_local_ns(server_time_ns); });
}

LinkCounters Link::counters() const {
  return impl_->with_core([](const LinkCore& core) { return core.counters(); });
}

std::string Link::transport() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->transport;
}

std::string Link::fallback_reason() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->fallback_reason;
}

std::shared_ptr<const Skin> Link::skin_of(const wire::GroomHash& groom) const {
  return impl_->with_core([&](const LinkCore& core) { return core.skin_of(groom); });
}

void Link::close() {
  impl_->leave();
}

}  // namespace hairnet::link
