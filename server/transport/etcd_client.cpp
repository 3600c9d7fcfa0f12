#include "server/transport/etcd_client.hpp"

#include <fmt/format.h>
#include <openssl/ssl.h>
#include <spdlog/spdlog.h>

#include <array>
#include <map>
#include <utility>
#include <vector>

#include "core/assert.hpp"
#include "server/files/files.hpp"
#include "server/fleet/etcd_api.hpp"
#include "server/telemetry/log_text.hpp"
#include "server/transport/http_peer.hpp"
#include "server/transport/io_loop_core.hpp"
#include "server/transport/tls_context.hpp"

namespace hairnet::server {
namespace {

using Error = boost::system::error_code;

// The longest times for a connection and for an answer. EtcdCalls cancels calls earlier, since it has shorter
// deadlines.
constexpr std::chrono::seconds kConnectTimeout{3}, kAnswerTimeout{10};
// At most this many idle connections to one endpoint wait for the next call; further ones are closed after their
// answer.
constexpr std::size_t kIdleMax = 4;
// A longer password, or file, is refused: the settings name a wrong file.
constexpr std::size_t kPasswordBytesMax = 1024, kPasswordFileBytesMax = 65'536;

// The error that the directory hears of. `is_connected`: the connection stood before the error.
EtcdError error_of(const Error& error, bool is_connected) {
  if (!is_connected) return EtcdError::unreachable;
  if (error == beast::error::timeout) return EtcdError::timeout;
  if (error == http::error::body_limit || error == http::error::header_limit || error == http::error::buffer_overflow)
    return EtcdError::oversize;
  const bool is_http = error.category() == http::make_error_code(http::error::bad_method).category();
  return is_http && error != http::error::end_of_stream && error != http::error::partial_message ? EtcdError::malformed
                                                                                                 : EtcdError::broken;
}

Result<std::shared_ptr<asio::ssl::context>> make_client_context(const EtcdOptions& options) {
  auto made = make_client_tls_context(options.ca, "etcd");
  if (!made || options.certificate.empty()) return made;
  for (const auto& [what, file] : {std::pair("certificate", options.certificate), std::pair("key", options.key)}) {
    if (std::string error = unreadable_pem(file); !error.empty())
      return Refusal(fmt::format("the {} for etcd, {}, cannot be read: {}", what, file, error));
  }
  SSL_CTX* native = (*made)->native_handle();
  if (SSL_CTX_use_certificate_chain_file(native, options.certificate.c_str()) != 1)
    return Refusal("the certificate for etcd, " + options.certificate + ", cannot be read: " + openssl_reason());
  if (SSL_CTX_use_PrivateKey_file(native, options.key.c_str(), SSL_FILETYPE_PEM) != 1 ||
      SSL_CTX_check_private_key(native) != 1)
    return Refusal("the key for etcd, " + options.key +
                   ", cannot be read, or is of another certificate: " + openssl_reason());
  return made;
}

}  // namespace

// Coroutines share it, so a call under way outlives the client and finds `sink` null.
struct EtcdClient::Impl : std::enable_shared_from_this<Impl> {
  using Request = http::request<http::string_body>;
  // A call under way.
  struct Open {
    // Null until the call has a connection.
    std::shared_ptr<HttpPeer> peer;
  };

  explicit Impl(IoLoop& loop) : executor(loop.core().serial) {}

  // Carries one call from its connection to the sink's answer or error.
  asio::awaitable<void> run(EtcdCall call);
  // Gives the sink the lines of a watch until it ends.
  asio::awaitable<void> read_stream(std::uint64_t id, std::shared_ptr<HttpPeer> peer);
  // Sends a request and reads its whole answer, within kAnswerTimeout.
  asio::awaitable<Error> exchange(HttpPeer& peer, const Request& request,
                                  http::response_parser<http::string_body>& parser);
  asio::awaitable<bool> authenticate(HttpPeer& peer, const EtcdEndpoint& endpoint);
  [[nodiscard]] Request request_of(const EtcdEndpoint& endpoint, const std::string& path,
                                   const std::string& body) const;
  [[nodiscard]] std::shared_ptr<HttpPeer> new_peer(std::size_t endpoint);
  // False after cancel(), or when the client has gone: nobody waits for the answer any more.
  [[nodiscard]] bool is_wanted(std::uint64_t id) const { return sink && open.contains(id); }
  // The entry is erased before the sink is called, because the sink may send a new call from within.
  void fail(std::uint64_t id, EtcdError error) {
    if (open.erase(id) > 0 && sink) sink->on_error(id, error, channel::monotonic_ns());
  }

  SerialExecutor executor;
  EtcdSink* sink = nullptr;
  std::vector<EtcdEndpoint> endpoints;
  // By endpoint: the idle connections.
  std::vector<std::vector<std::shared_ptr<HttpPeer>>> idle;
  // The calls under way, by their number.
  std::map<std::uint64_t, Open> open;
  std::shared_ptr<asio::ssl::context> tls;
  // The user of etcd and its password, empty without one, and the token that etcd has given for them.
  std::string user, password, token;
  // etcd has refused the user, and the log has said so.
  bool is_user_refused = false;
};

EtcdClient::Impl::Request EtcdClient::Impl::request_of(const EtcdEndpoint& endpoint, const std::string& path,
                                                       const std::string& body) const {
  Request request(http::verb::post, path, 11);
  request.set(http::field::host, endpoint.host + ":" + std::to_string(endpoint.port));
  request.set(http::field::content_type, "application/json");
  // etcd takes the token alone, without the word Bearer.
  if (!token.empty()) request.set(http::field::authorization, token);
  request.body() = body;
  request.prepare_payload();
  return request;
}

std::shared_ptr<HttpPeer> EtcdClient::Impl::new_peer(std::size_t endpoint) {
  return std::make_shared<HttpPeer>(executor, endpoints[endpoint].is_tls ? tls.get() : nullptr, etcd::kAnswerBytesMax);
}

asio::awaitable<Error> EtcdClient::Impl::exchange(HttpPeer& peer, const Request& request,
                                                  http::response_parser<http::string_body>& parser) {
  parser.body_limit(etcd::kAnswerBytesMax);
  peer.expires_after(kAnswerTimeout);
  if (const Error error = co_await peer.write(request)) co_return error;
  co_return co_await peer.read(parser);
}

// Returns false when etcd refuses the user, or does not answer.
asio::awaitable<bool> EtcdClient::Impl::authenticate(HttpPeer& peer, const EtcdEndpoint& endpoint) {
  const etcd::Request asked = etcd::authenticate(user, password);
  http::response_parser<http::string_body> parser;
  const Error error = co_await exchange(peer, request_of(endpoint, asked.path, asked.body), parser);
  if (error) co_return false;
  const auto& answer = parser.get();
  // The body is etcd's reason, until a token has been read.
  Result<std::string> given = Refusal(answer.body());
  if (answer.result_int() == 200) given = etcd::parse_token(answer.body());
  if (given)
    token = *given;
  else if (!is_user_refused)
    spdlog::warn("event=etcd_user_refused user={} status={} detail={}", log_text(user), answer.result_int(),
                 log_text(given.error()));
  // A wrong password is logged once, and not at each call.
  is_user_refused = !given;
  co_return given.has_value();
}

asio::awaitable<void> EtcdClient::Impl::run(EtcdCall call) {
  const EtcdEndpoint& endpoint = endpoints[call.endpoint];
  auto& waiting = idle[call.endpoint];
  // An idle connection may have been closed by etcd meanwhile: then a new one is tried.
  for (bool is_reused = !waiting.empty() && !call.is_stream; is_wanted(call.id); is_reused = false) {
    // A stream always gets a new connection, which it keeps until its end.
    std::shared_ptr<HttpPeer> peer = is_reused ? waiting.back() : new_peer(call.endpoint);
    if (is_reused) waiting.pop_back();
    open[call.id].peer = peer;
    if (!is_reused) {
      if (const Error error = co_await peer->connect(endpoint.host, endpoint.port, kConnectTimeout))
        co_return fail(call.id, error_of(error, false));
    }
    if (!is_wanted(call.id)) co_return;
    // One token serves all calls, until etcd refuses it.
    if (token.empty() && !user.empty() && !co_await authenticate(*peer, endpoint))
      co_return fail(call.id, EtcdError::refused);
    const Request request = request_of(endpoint, call.path, call.body);
    if (call.is_stream) {
      peer->expires_after(kAnswerTimeout);
      if (const Error error = co_await peer->write(request)) co_return fail(call.id, error_of(error, true));
      co_return co_await read_stream(call.id, std::move(peer));
    }
    http::response_parser<http::string_body> parser;
    const Error error = co_await exchange(*peer, request, parser);
    if (!is_wanted(call.id)) co_return;
    // The connection was closed while it waited, most likely before etcd saw the request, so it is sent again on a new
    // one.
    if (error && is_reused && error_of(error, true) == EtcdError::broken) continue;
    if (error) co_return fail(call.id, error_of(error, true));
    const auto& answer = parser.get();
    // The next call asks for a new token.
    if (answer.result_int() == 401 || answer.result_int() == 400) token.clear();
    if (answer.keep_alive() && waiting.size() < kIdleMax) waiting.push_back(std::move(peer));
    open.erase(call.id);
    sink->on_answer(call.id, static_cast<int>(answer.result_int()), answer.body(), channel::monotonic_ns());
    co_return;
  }
}

asio::awaitable<void> EtcdClient::Impl::read_stream(std::uint64_t id, std::shared_ptr<HttpPeer> peer) {
  http::response_parser<http::buffer_body> parser;
  // A watch has no end, so the bound is on each line instead of the whole.
  parser.body_limit(boost::none);
  if (const Error error = co_await peer->read_header(parser)) co_return fail(id, error_of(error, true));
  if (!is_wanted(id)) co_return;
  if (parser.get().result_int() != 200) {
    open.erase(id);
    sink->on_answer(id, static_cast<int>(parser.get().result_int()), {}, channel::monotonic_ns());
    co_return;
  }
  // etcd is silent while nothing changes. A dead one is noticed by TCP's probes (HttpPeer).
  peer->expires_never();
  std::array<char, 16 << 10> piece;
  std::string text;
  while (!parser.is_done()) {
    parser.get().body().data = piece.data();
    parser.get().body().size = piece.size();
    const Error error = co_await peer->read_some(parser);
    if (!is_wanted(id)) co_return;
    if (error && error != http::error::need_buffer) co_return fail(id, error_of(error, true));
    text.append(piece.data(), piece.size() - parser.get().body().size);
    if (text.size() > etcd::kAnswerBytesMax) co_return fail(id, EtcdError::oversize);
    // The gateway writes one JSON object in a line; the last piece may hold only a part of one, and waits for its rest.
    std::size_t begin = 0;
    for (std::size_t end = 0; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1) {
      sink->on_line(id, std::string_view(text).substr(begin, end - begin), channel::monotonic_ns());
      if (!is_wanted(id)) co_return;
    }
    text.erase(0, begin);
  }
  fail(id, EtcdError::broken);
}

Result<std::unique_ptr<EtcdClient>> EtcdClient::create(IoLoop& loop, const EtcdOptions& options) {
  if (std::string wrong = validate(options); !wrong.empty()) return Refusal(std::move(wrong));
  HAIRNET_ASSERT(!options.endpoints.empty());
  auto impl = std::make_shared<Impl>(loop);
  bool needs_tls = false;
  for (const std::string& url : options.endpoints) {
    impl->endpoints.push_back(*parse_etcd_endpoint(url));
    needs_tls |= impl->endpoints.back().is_tls;
  }
  impl->idle.resize(impl->endpoints.size());
  if (needs_tls) {
    auto context = make_client_context(options);
    if (!context) return Refusal(context.error());
    impl->tls = std::move(*context);
  }
  if (!options.user.empty()) {
    impl->user = options.user;
    const Result<std::string> text = read_text_file(options.password_file, kPasswordFileBytesMax);
    if (!text) return Refusal("the password file for etcd, " + options.password_file + ": " + text.error());
    std::string_view lines = *text;
    impl->password = take_line(lines);
    if (impl->password.empty() || impl->password.size() > kPasswordBytesMax)
      return Refusal("the password file for etcd, " + options.password_file + ", has no password in its first line");
  }
  return std::unique_ptr<EtcdClient>(new EtcdClient(std::move(impl)));
}

EtcdClient::EtcdClient(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}

EtcdClient::~EtcdClient() {
  impl_->sink = nullptr;
  // Closing the sockets ends the coroutines, which still hold Impl.
  for (auto& [id, one] : impl_->open)
    if (one.peer) one.peer->close();
  for (auto& waiting : impl_->idle)
    for (const auto& peer : waiting) peer->close();
}

void EtcdClient::set_sink(EtcdSink* sink) {
  impl_->sink = sink;
}

void EtcdClient::send(EtcdCall call) {
  HAIRNET_ASSERT(call.endpoint < impl_->endpoints.size());
  impl_->open[call.id] = {};
  asio::co_spawn(
      impl_->executor,
      [impl = impl_, call = std::move(call)]() mutable -> asio::awaitable<void> {
        // Starting later keeps the promise that the sink is never called inside send().
        co_await asio::post(impl->executor, asio::use_awaitable);
        co_await impl->run(std::move(call));
      },
      asio::detached);
}

void EtcdClient::cancel(std::uint64_t call) {
  const auto found = impl_->open.find(call);
  if (found == impl_->open.end()) return;
  if (found->second.peer) found->second.peer->close();
  impl_->open.erase(found);
}

}  // namespace hairnet::server
