#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <boost/asio.hpp>
#include <boost/asio/ssl.hpp>
#include <cerrno>
#include <chrono>
#include <deque>
#include <utility>
#include <vector>

#include "client/link/download_reader.hpp"
#include "client/link/page_request.hpp"
#include "client/link/server_stream.hpp"
#include "client/link/webtransport/session.hpp"
#include "schema/channel/monotonic_clock.hpp"

// Packets on the channel, in the datagrams and on the downloads of a WebTransport session, over a UDP socket.
namespace hairnet::link {
namespace {

using asio::ip::udp;
using boost::system::error_code;

// The buffers of the socket in the system: frames of a large room come all at once.
constexpr int kSystemBufferBytes = 1 << 20;
// More than a UDP packet has on an Ethernet path, 1500 bytes.
constexpr std::size_t kPacketBytesMax = 2048;
// turn() takes this many packets before it gives way to the thread's other work.
constexpr int kPacketsAtOnceMax = 64;
// The most datagrams that wait for read(). A tick brings one datagram for every few people, all at once.
constexpr std::size_t kIncomingDatagramsMax = 1024;
// kWait_ns_max, an hour, stands for a wait without end. One call of rest() handles packets for kRest_ns, 20 ms.
constexpr std::int64_t kWait_ns_max = 3'600'000'000'000, kRest_ns = 20'000'000;

class WebTransportStream final : public WebTransportAttempt, private WebTransportEvents {
 public:
  WebTransportStream(asio::io_context& io, StreamOptions options, std::shared_ptr<WebTransportMemory> memory)
      : options_(std::move(options)),
        memory_(memory ? std::move(memory) : std::make_shared<WebTransportMemory>()),
        page_(io, options_),
        io_(std::make_shared<Io>(io)) {}

  asio::awaitable<std::string> open() override {
    std::string error;
    // Streams that share a memory read the page once.
    if (!memory_->page) error = co_await read_page();
    // close() may have come while the page was read, before there was a session to close.
    if (error.empty() && is_closed_) error = "closed";
    if (error.empty()) error = begin();
    if (failure_ != WebTransportFailure::none) co_return error;
    while (error.empty() && !session_->is_open() && !session_->is_over()) co_await turn();
    if (session_ && session_->is_open()) co_return std::string();
    if (error.empty()) error = session_->reason();
    failure_ = WebTransportFailure::blocked;
    // The page may be out of date, as after a change of the certificate: the next attempt reads it again.
    memory_->page.reset();
    co_return "no WebTransport with " + options_.server.authority() + ": " +
        (error.empty() ? "the server closed the connection" : error);
  }

  asio::awaitable<Read> read() override {
    // The bytes of the last read count against the window until now, when the caller has used them. So the server stops
    // when the caller does not read.
    session_->take(std::exchange(untaken_bytes_, 0));
    while (channel_bytes_.empty() && datagrams_.empty() && downloads_.packets().empty()) {
      if (session_->is_over()) co_return Read{{}, describe_end()};
      co_await turn();
    }
    const bool is_packet = channel_bytes_.empty();
    if (!is_packet) {
      current_ = std::exchange(channel_bytes_, {});
      untaken_bytes_ = current_.size();
    } else if (!datagrams_.empty()) {
      current_ = std::move(datagrams_.front());
      datagrams_.pop_front();
    } else {
      DownloadReader::Packet packet = downloads_.take();
      session_->take_download(packet.download, packet.bytes.size());
      current_ = std::move(packet.bytes);
    }
    co_return Read{current_, {}, is_packet};
  }

  asio::awaitable<bool> write(std::span<const std::uint8_t> bytes, bool may_be_lost) override {
    std::vector<std::uint8_t> copy(bytes.begin(), bytes.end());
    // A packet that is too large for a datagram goes into the channel, where it cannot get lost.
    if (!may_be_lost || !session_->send_datagram(copy, channel::monotonic_ns())) {
      while (!session_->is_writable()) {
        if (session_->is_over()) co_return false;
        error_code ignored;
        // flush() ends this wait when there is room again. Until then packets stay in the core, which drops old poses.
        io_->writable.expires_after(std::chrono::nanoseconds(kWait_ns_max));
        co_await io_->writable.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
      }
      session_->send(std::move(copy));
    }
    flush();
    co_return !session_->is_over();
  }

  // What was sent before still arrives; the server then ends the session.
  void half_close() override {
    session_->end_channel();
    flush();
  }

  void close() override {
    is_closed_ = true;
    page_.cancel();
    if (session_) {
      // The packet that tells the server leaves before the socket is closed. The server would wait for its idle time
      // otherwise.
      session_->close("closed by this client", channel::monotonic_ns());
      flush();
    }
    error_code ignored;
    io_->socket.close(ignored);
    io_->event.cancel();
    io_->writable.cancel();
  }

  [[nodiscard]] bool has_messages() const override { return true; }
  [[nodiscard]] bool has_datagrams() const override { return true; }
  [[nodiscard]] std::string_view transport() const override { return "webtransport"; }
  [[nodiscard]] WebTransportFailure failure() const override { return failure_; }
  asio::awaitable<bool> rest() override {
    co_await turn(kRest_ns);
    co_return !session_->is_over();
  }

 private:
  // What the handlers of Asio use. They share it, since they may run after the stream is gone.
  struct Io {
    explicit Io(asio::io_context& io) : socket(io), event(io), writable(io) {}
    udp::socket socket;
    // Coroutines wait on these: `event` is cancelled when something has happened, `writable` when there is room to
    // write.
    asio::steady_timer event, writable;
    // A wait for the socket is pending.
    bool is_watched = false;
  };

  // Reads the WebTransport page of the server into memory_. Returns one line if the page offers no WebTransport;
  // failure_ then says whether another transport is worth a try.
  asio::awaitable<std::string> read_page() {
    PageRequest::Answer answer = co_await page_.get(kWebTransportPage);
    failure_ = answer.is_reachable ? WebTransportFailure::absent : WebTransportFailure::unreachable;
    if (!answer.error.empty())
      co_return answer.is_reachable ? "no WebTransport at " + options_.server.authority() + ": " + answer.error
                                    : answer.error;
    Result<WebTransportPage> page = read_web_transport_page(answer.text);
    if (!page) co_return page.error();
    if (page->port == 0) co_return "the server at " + options_.server.authority() + " has no WebTransport";
    memory_->page = std::move(*page);
    memory_->server = answer.server;
    failure_ = WebTransportFailure::none;
    co_return std::string();
  }

  // Opens a socket to the machine that has answered with the page, and begins the session. Returns an empty string, or
  // one line with the reason of the failure.
  std::string begin() {
    const WebTransportPage& page = *memory_->page;
    const udp::endpoint remote(*memory_->server, page.port);
    error_code error;
    io_->socket.open(remote.protocol(), error);
    if (!error && options_.local && options_.local->is_v4() == remote.address().is_v4())
      io_->socket.bind({*options_.local, 0}, error);
    // A connected UDP socket takes packets of this server alone, and hears when nothing listens there.
    if (!error) io_->socket.connect(remote, error);
    if (!error) io_->socket.non_blocking(true, error);
    const udp::endpoint local = error ? udp::endpoint() : io_->socket.local_endpoint(error);
    if (error) return "no UDP socket: " + error.message();
    tune(remote.address().is_v6());
    WebTransportTarget target;
    target.path = {address_of(local), address_of(remote)};
    target.authority = options_.server.authority_at(page.port);
    target.url_path = page.path;
    target.certificate = {options_.server.host, page.hashes, options_.tls.ca_file, options_.tls.insecure};
    auto session = WebTransportSession::create(std::move(target), *this, channel::monotonic_ns());
    if (!session) return session.error();
    session_ = std::move(*session);
    flush();
    return {};
  }

  static quic::Address address_of(const udp::endpoint& endpoint) {
    return quic::Address::of(endpoint.data(), static_cast<socklen_t>(endpoint.size()));
  }

  // Sets options of the socket. A failure is ignored, because the socket works without them too.
  void tune(bool is_v6) {
    const auto set = [this](int level, int name, int value) {
      ::setsockopt(io_->socket.native_handle(), level, name, &value, sizeof(value));
    };
    set(SOL_SOCKET, SO_RCVBUF, kSystemBufferBytes);
    set(SOL_SOCKET, SO_SNDBUF, kSystemBufferBytes);
    // QUIC finds out by itself how large packets may be: the system neither cuts them nor guesses.
    set(IPPROTO_IP, IP_MTU_DISCOVER, IP_PMTUDISC_PROBE);
    if (is_v6) set(IPPROTO_IPV6, IPV6_MTU_DISCOVER, IPV6_PMTUDISC_PROBE);
  }

  // Takes the packets that have come, and sends those that are due. If none had come, waits until some may have, or
  // until QUIC has something to do. If some had come, lets the thread do its other work first, so that a server that
  // never pauses cannot hold it up.
  asio::awaitable<void> turn(std::int64_t wait_ns_max = kWait_ns_max) {
    const bool was_open = session_->is_open();
    const bool has_come = receive();
    session_->poll(channel::monotonic_ns());
    flush();
    if (session_->is_over() || session_->is_open() != was_open) co_return;
    if (has_come) {
      co_await asio::post(io_->socket.get_executor(), asio::use_awaitable);
      co_return;
    }
    watch();
    // What flush() sends meanwhile may bring this time forward; it then wakes the wait.
    due_ns_ = session_->due_ns();
    const std::int64_t wait_ns = std::clamp<std::int64_t>(due_ns_ - channel::monotonic_ns(), 0, wait_ns_max);
    io_->event.expires_after(std::chrono::nanoseconds(wait_ns));
    error_code ignored;
    co_await io_->event.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
  }

  // Makes the socket wake turn() when a packet comes.
  void watch() {
    if (std::exchange(io_->is_watched, true)) return;
    // One wait at a time is enough. The handler may run after this stream is gone, so it shares the Io and not the
    // stream.
    io_->socket.async_wait(udp::socket::wait_read, [io = io_](const error_code&) {
      io->is_watched = false;
      io->event.cancel();
    });
  }

  // Returns whether packets had come.
  bool receive() {
    std::array<std::uint8_t, kPacketBytesMax> buffer;
    const std::int64_t now_ns = channel::monotonic_ns();
    int taken = 0;
    // The bound gives timers and other connections of the thread their turn.
    for (; taken < kPacketsAtOnceMax && !session_->is_over(); ++taken) {
      const ssize_t count = ::recv(io_->socket.native_handle(), buffer.data(), buffer.size(), MSG_DONTWAIT);
      if (count < 0) {
        if (errno == ECONNREFUSED) is_refused_ = true;
        break;
      }
      session_->receive(std::span(buffer).first(static_cast<std::size_t>(count)), now_ns);
    }
    end_if_refused();
    return taken > 0;
  }

  // Sends the packets that QUIC wants to send now, and wakes those that wait for what has changed.
  void flush() {
    session_->write(
        [this](std::span<const std::uint8_t> packet) {
          // A packet that the system does not take is dropped; QUIC notices that as a loss.
          const ssize_t count =
              ::send(io_->socket.native_handle(), packet.data(), packet.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
          // The system reports a refusal of an earlier packet at the next call, to send or to receive.
          if (count < 0 && errno == ECONNREFUSED) is_refused_ = true;
        },
        channel::monotonic_ns());
    end_if_refused();
    if (session_->is_writable() || session_->is_over()) io_->writable.cancel();
    if (session_->due_ns() < due_ns_ || session_->is_over()) io_->event.cancel();
  }

  // Ends the session when the system has reported that no socket has the server's UDP port.
  void end_if_refused() {
    if (is_refused_) session_->close("nothing listens on its UDP port", channel::monotonic_ns());
  }

  [[nodiscard]] std::string describe_end() const {
    const std::string& error = session_->reason();
    if (error.empty()) return "the server closed the connection without a goodbye";
    return "the connection to " + options_.server.authority() + " broke: " + error;
  }

  void on_channel_bytes(std::span<const std::uint8_t> bytes) override {
    channel_bytes_.insert(channel_bytes_.end(), bytes.begin(), bytes.end());
  }
  void on_datagram(std::span<const std::uint8_t> bytes) override {
    // Where the caller reads too slowly the oldest goes, because a newer frame replaces it.
    if (datagrams_.size() >= kIncomingDatagramsMax) datagrams_.pop_front();
    datagrams_.emplace_back(bytes.begin(), bytes.end());
  }
  void on_download_bytes(StreamId download, std::span<const std::uint8_t> bytes, bool is_last) override {
    if (!downloads_.feed(download, bytes, is_last))
      session_->close("the server sent a download that is not made of packets", channel::monotonic_ns());
  }
  void on_download_reset(StreamId download) override { session_->take_download(download, downloads_.drop(download)); }

  const StreamOptions options_;
  const std::shared_ptr<WebTransportMemory> memory_;
  PageRequest page_;
  const std::shared_ptr<Io> io_;
  // Null until begin().
  std::unique_ptr<WebTransportSession> session_;
  // These three hold what has arrived and is not read yet. The window bounds the channel's bytes, which are read first:
  // datagrams may belong to members that messages announce.
  std::vector<std::uint8_t> channel_bytes_;
  std::deque<std::vector<std::uint8_t>> datagrams_;
  DownloadReader downloads_;
  // The bytes that the last read() returned.
  std::vector<std::uint8_t> current_;
  // The bytes of the channel that the next read() gives back to the window.
  std::size_t untaken_bytes_ = 0;
  // turn() waits until this time.
  std::int64_t due_ns_ = 0;
  WebTransportFailure failure_ = WebTransportFailure::none;
  bool is_closed_ = false, is_refused_ = false;
};

}  // namespace

std::shared_ptr<WebTransportAttempt> make_web_transport_stream(asio::io_context& io, StreamOptions options,
                                                               std::shared_ptr<WebTransportMemory> memory) {
  return std::make_shared<WebTransportStream>(io, std::move(options), std::move(memory));
}

}  // namespace hairnet::link
