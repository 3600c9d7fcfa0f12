#include "client/link/link.hpp"

#include <netinet/tcp.h>
#include <sys/socket.h>

#include <boost/asio.hpp>
#include <chrono>
#include <future>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "client/link/event_queue.hpp"
#include "client/link/send_queue.hpp"
#include "client/link/upload_queue.hpp"
#include "schema/channel/clock_estimate.hpp"
#include "schema/channel/packet_splitter.hpp"
#include "schema/wire/groom_file.hpp"

namespace hairnet::link {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;
using std::chrono::milliseconds;

// A pose waits for at most one chunk of a groom, and for what the kernel holds unsent: both are kept small.
constexpr std::size_t kChunkBytes = 64u << 10;
static_assert(kChunkBytes <= wire::kGroomChunkBytesMax);
constexpr int kUnsentBytesMax = 64 << 10;
constexpr unsigned kUnacknowledgedMax_ms = 15'000;
constexpr milliseconds kGoodbyeWait{400};

// What the kernel may hold back, and how long it waits for a peer that vanished. Without these it works less well.
void tune(tcp::socket& socket) {
  error_code ignored;
  socket.set_option(tcp::no_delay(true), ignored);
  setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &kUnsentBytesMax, sizeof kUnsentBytesMax);
  setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_USER_TIMEOUT, &kUnacknowledgedMax_ms,
             sizeof kUnacknowledgedMax_ms);
}

asio::steady_timer::duration seconds(double count) {
  return std::chrono::duration_cast<asio::steady_timer::duration>(std::chrono::duration<double>(count));
}

std::int64_t steady_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

// A refusal of a whole groom, after which its bytes are of no use.
bool ends_upload(const wire::Error& error) {
  return error.character == 0 && error.groom != wire::GroomHash{};
}

}  // namespace

// But for what `mutex` guards and the event queue, everything belongs to the I/O thread.
struct Link::Impl {
  explicit Impl(LinkOptions o) : options(std::move(o)), thread([this] { io.run(); }) {}

  // Leaves behind whatever is still waiting when the goodbye takes too long.
  ~Impl() {
    asio::post(io, [this] { leave(); });
    ended_future.wait_for(kGoodbyeWait + milliseconds(200));
    work.reset();
    io.stop();
    thread.join();
  }

  asio::awaitable<void> run() {
    const auto redirect = [this] { return asio::redirect_error(asio::use_awaitable, fault); };
    tcp::resolver resolver(io);
    const auto addresses = co_await resolver.async_resolve(options.host, std::to_string(options.port), redirect());
    if (ended) co_return;
    if (fault) co_return end(wire::GoodbyeReason::none, "cannot find " + server_name() + ": " + fault.message());
    co_await asio::async_connect(socket, addresses, redirect());
    if (ended) co_return;
    if (fault) co_return end(wire::GoodbyeReason::none, "cannot connect to " + server_name() + ": " + fault.message());
    tune(socket);
    wire::Hello hello;
    hello.client_name = options.client_name;
    if (co_await write(std::move(hello))) co_await read_loop();
  }

  asio::awaitable<void> read_loop() {
    std::vector<std::uint8_t> buffer(64u << 10);
    error_code ec;
    while (!ended) {
      const std::size_t count =
          co_await socket.async_read_some(asio::buffer(buffer), asio::redirect_error(asio::use_awaitable, ec));
      if (ended) co_return;
      if (ec) co_return on_closed(ec);
      {
        const std::lock_guard lock(mutex);
        counters.bytes_received += count;
      }
      const bool sound =
          splitter.feed({buffer.data(), count}, [this](std::span<const std::uint8_t> packet) { on_packet(packet); });
      if (!sound) end(wire::GoodbyeReason::protocol_error, "the server sent a packet of impossible size");
    }
  }

  void on_closed(const error_code& ec) {
    if (leaving)
      end(wire::GoodbyeReason::client_leaves, "closed by this client");
    else if (ec == asio::error::eof)
      end(wire::GoodbyeReason::none, "the server closed the connection without a goodbye");
    else
      end(wire::GoodbyeReason::none, "the connection to " + server_name() + " broke: " + ec.message());
  }

  void on_packet(std::span<const std::uint8_t> packet) {
    if (ended) return;
    wire::Decoded decoded = wire::decode_packet(packet);
    if (decoded.error != wire::DecodeError::none)
      return end(wire::GoodbyeReason::protocol_error, "the server sent a bad packet: " + decoded.detail);
    {
      const std::lock_guard lock(mutex);
      clock.observe(decoded.envelope.clock_ns, steady_ns());
      if (std::holds_alternative<wire::FrameBatch>(decoded.envelope.message))
        counters.frame_bytes_received += packet.size();
    }
    std::visit([this](auto& message) { on(message); }, decoded.envelope.message);
  }

  void on(wire::Welcome& welcome) {
    if (welcomed) return end(wire::GoodbyeReason::protocol_error, "the server sent a second welcome");
    welcomed = true;
    deadline.cancel();
    push(Connected{welcome});
    answer.set_value(welcome);
    asio::co_spawn(io, write_loop(), asio::detached);
  }
  void on(wire::GroomNeed& need) {
    uploads.need(need);  // a groom that was dropped meanwhile is no longer known
    wake.cancel();
  }
  void on(wire::GroomStatus& status) {
    // Merely queued it may still be on its way from another client, and that one may leave.
    if (status.state != wire::GroomState::queued) uploads.drop(status.hash);
    push(status);
  }
  void on(wire::Error& error) {
    if (ends_upload(error)) uploads.drop(error.groom);
    push(std::move(error));
  }
  void on(wire::Goodbye& goodbye) { end(goodbye.reason, "the server says goodbye: " + goodbye.detail); }
  void on(wire::CharacterAdded& m) { push(m); }
  void on(wire::CharacterRemoved& m) { push(m); }
  void on(wire::LevelRecord& m) { push(std::move(m)); }
  void on(wire::FrameBatch& m) { push(std::move(m)); }
  void on(auto&) { end(wire::GoodbyeReason::protocol_error, "the server sent a message that only clients send"); }

  void push(Event event) {
    if (!events.push(std::move(event))) end(wire::GoodbyeReason::none, "this client does not poll its events");
  }

  asio::awaitable<void> write_loop() {
    while (!ended) {
      std::optional<wire::Message> message = queue.pop();
      const bool goodbye = message && std::holds_alternative<wire::Goodbye>(*message);
      if (!message && !leaving) {
        if (std::optional<wire::GroomChunk> chunk = uploads.next_chunk()) message = std::move(*chunk);
      }
      if (!message) {
        error_code woken;
        wake.expires_after(seconds(options.keep_alive_s));
        co_await wake.async_wait(asio::redirect_error(asio::use_awaitable, woken));
        if (woken || ended || leaving) continue;
        message = wire::PoseBatch{};  // nothing to say, but still here
      }
      if (!co_await write(std::move(*message))) co_return;
      if (goodbye) {
        error_code ignored;
        socket.shutdown(tcp::socket::shutdown_send, ignored);
        co_return;
      }
    }
  }

  // False when it could not be written; the reader then learns why, or the deadline ends it.
  asio::awaitable<bool> write(wire::Message message) {
    const std::vector<std::uint8_t> packet = wire::encode_packet({steady_ns(), std::move(message)});
    error_code ec;
    co_await asio::async_write(socket, asio::buffer(packet), asio::redirect_error(asio::use_awaitable, ec));
    if (ended) co_return false;
    if (ec) {
      end_after(milliseconds(500), "the connection to " + server_name() + " broke: " + ec.message());
      co_return false;
    }
    const std::lock_guard lock(mutex);
    counters.bytes_sent += packet.size();
    co_return true;
  }

  void post_message(wire::Message message) {
    asio::post(io, [this, m = std::move(message)]() mutable {
      if (ended || leaving) return;
      if (!queue.push(std::move(m)))
        end(wire::GoodbyeReason::none, "more messages wait to be sent than the server takes");
      wake.cancel();
    });
  }

  void end_after(asio::steady_timer::duration wait, std::string detail) {
    deadline.expires_after(wait);
    deadline.async_wait([this, detail = std::move(detail)](const error_code& ec) {
      if (!ec) end(leaving ? wire::GoodbyeReason::client_leaves : wire::GoodbyeReason::none, detail);
    });
  }

  void leave() {
    if (ended || leaving) return;
    leaving = true;
    if (!welcomed || !queue.push(wire::Goodbye{wire::GoodbyeReason::client_leaves, ""}))
      return end(wire::GoodbyeReason::client_leaves, "closed by this client");
    end_after(kGoodbyeWait, "closed by this client");
    wake.cancel();
  }

  void end(wire::GoodbyeReason reason, std::string detail) {
    if (ended) return;
    ended = true;
    if (!welcomed) answer.set_value(Refusal(detail));
    events.push_last({reason, std::move(detail)});
    error_code ignored;
    socket.close(ignored);
    wake.cancel();
    deadline.cancel();
    ended_promise.set_value();
  }

  [[nodiscard]] std::string server_name() const { return options.host + ":" + std::to_string(options.port); }

  const LinkOptions options;
  asio::io_context io;
  asio::executor_work_guard<asio::io_context::executor_type> work = asio::make_work_guard(io);
  tcp::socket socket{io};
  asio::steady_timer wake{io};      // the writer waits on it when there is nothing to write
  asio::steady_timer deadline{io};  // for the welcome, later for the goodbye
  error_code fault;                 // of resolving and connecting
  bool welcomed = false, leaving = false, ended = false;
  channel::PacketSplitter splitter{wire::kPacketBytesMax};
  UploadQueue uploads{kChunkBytes};
  SendQueue queue;
  EventQueue events;
  std::promise<Result<wire::Welcome>> answer;
  std::promise<void> ended_promise;
  std::future<void> ended_future = ended_promise.get_future();
  bool connect_called = false;  // caller's thread

  mutable std::mutex mutex;  // guards the rest
  channel::ClockEstimate clock;
  LinkCounters counters;

  std::thread thread;  // last: it uses all of the above
};

Link::Link(LinkOptions options) : impl_(std::make_unique<Impl>(std::move(options))) {}
Link::~Link() = default;

Result<wire::Welcome> Link::connect() {
  if (std::exchange(impl_->connect_called, true)) return Refusal("connect() was called before");
  std::future<Result<wire::Welcome>> answer = impl_->answer.get_future();
  asio::post(impl_->io, [impl = impl_.get()] {
    if (impl->ended) return;
    impl->end_after(seconds(impl->options.connect_timeout_s),
                    "no welcome from " + impl->server_name() + " within the time-out");
    asio::co_spawn(impl->io, impl->run(), asio::detached);
  });
  return answer.get();
}

wire::GroomHash Link::upload(const Groom& groom) {
  auto bytes = std::make_shared<const std::vector<std::uint8_t>>(wire::encode_groom(groom));
  const wire::GroomHash hash = wire::hash_groom(*bytes);
  asio::post(impl_->io, [impl = impl_.get(), hash, bytes = std::move(bytes)] {
    if (impl->ended || impl->leaving) return;
    if (const auto offer = impl->uploads.offer(hash, bytes); offer && !impl->queue.push(*offer))
      impl->end(wire::GoodbyeReason::none, "more messages wait to be sent than the server takes");
    impl->wake.cancel();
  });
  return hash;
}

void Link::add_character(std::uint32_t character, const wire::GroomHash& groom, LevelIndex level) {
  impl_->post_message(wire::AddCharacter{character, groom, level});
}

void Link::set_level(std::uint32_t character, LevelIndex level) {
  impl_->post_message(wire::SetLevel{character, level});
}

void Link::set_material(std::uint32_t character, const MaterialScale& scale) {
  impl_->post_message(wire::SetMaterial{character, scale});
}

void Link::set_wind(const Wind& wind) {
  impl_->post_message(wire::SetWind{wind});
}

void Link::remove_character(std::uint32_t character) {
  impl_->post_message(wire::RemoveCharacter{character});
}

void Link::push_poses(std::vector<wire::PoseSample> poses) {
  asio::post(impl_->io, [impl = impl_.get(), poses = std::move(poses)]() mutable {
    if (impl->ended || impl->leaving) return;
    impl->queue.push_poses(std::move(poses));
    impl->wake.cancel();
    const std::lock_guard lock(impl->mutex);
    impl->counters.poses_dropped = impl->queue.poses_dropped();
  });
}

std::vector<Event> Link::poll() {
  return impl_->events.take_all();
}

std::int64_t Link::now_ns() const {
  return steady_ns();
}

std::int64_t Link::to_local_ns(std::int64_t server_time_ns) const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->clock.known() ? impl_->clock.to_local(server_time_ns) : server_time_ns;
}

LinkCounters Link::counters() const {
  LinkCounters counters;
  {
    const std::lock_guard lock(impl_->mutex);
    counters = impl_->counters;
  }
  counters.frames_dropped = impl_->events.frames_dropped();
  return counters;
}

void Link::close() {
  asio::post(impl_->io, [impl = impl_.get()] { impl->leave(); });
}

}  // namespace hairnet::link
