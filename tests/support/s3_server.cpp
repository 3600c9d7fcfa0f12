#include "tests/support/s3_server.hpp"

#include <openssl/evp.h>
#include <openssl/hmac.h>

#include <boost/asio.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <optional>
#include <regex>
#include <sstream>

namespace hairnet::support {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
using Tcp = asio::ip::tcp;
using Request = http::request<http::string_body>;
using Response = http::response<http::string_body>;

constexpr auto kAwaitable = asio::as_tuple(asio::use_awaitable);
// This limit is above the largest groom (kGroomBytesMax, 256 MB), so that any object fits.
constexpr std::uint64_t kBodyBytesMax = 300 << 20;
// S3 refuses requests whose time is more than 15 minutes off.
constexpr double kClockSkew_s = 900;

std::string hex(const std::string& bytes) {
  std::string text;
  for (const unsigned char byte : bytes) {
    char digits[3];
    std::snprintf(digits, sizeof(digits), "%02x", byte);
    text += digits;
  }
  return text;
}

std::string sha256(const std::string& text) {
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int size = 0;
  EVP_Digest(text.data(), text.size(), digest, &size, EVP_sha256(), nullptr);
  return {reinterpret_cast<const char*>(digest), size};
}

std::string hmac(const std::string& key, const std::string& text) {
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int size = 0;
  HMAC(EVP_sha256(), key.data(), static_cast<int>(key.size()), reinterpret_cast<const unsigned char*>(text.data()),
       text.size(), digest, &size);
  return {reinterpret_cast<const char*>(digest), size};
}

std::string field(const Request& request, const std::string& name) {
  return std::string(request[name]);
}

// Returns S3's code of what is wrong with the request's signature (AWS Signature Version 4); empty when this key has
// signed it.
std::string wrong_with(const Request& request, const S3ServerDef& def) {
  static const std::regex form(
      "AWS4-HMAC-SHA256 Credential=([^/]+)/(\\d{8})/([^/]+)/s3/aws4_request, ?SignedHeaders=([^,]+), "
      "?Signature=([0-9a-f]{64})");
  std::smatch parts;
  const std::string authorization = field(request, "authorization");
  if (!std::regex_match(authorization, parts, form)) return "AccessDenied";
  if (parts[1] != def.access) return "InvalidAccessKeyId";
  if (parts[3] != def.region) return "AuthorizationHeaderMalformed";
  const std::string date = field(request, "x-amz-date"), signed_names = parts[4];
  std::tm utc{};
  if (::strptime(date.c_str(), "%Y%m%dT%H%M%SZ", &utc) == nullptr || date.substr(0, 8) != parts[2])
    return "AccessDenied";
  if (std::abs(std::difftime(std::time(nullptr), ::timegm(&utc))) > kClockSkew_s) return "RequestTimeTooSkewed";
  const std::string payload_hash = field(request, "x-amz-content-sha256");
  if (payload_hash != hex(sha256(request.body()))) return "XAmzContentSHA256Mismatch";
  for (const char* needed : {"host", "x-amz-content-sha256", "x-amz-date"}) {
    if ((";" + signed_names + ";").find(";" + std::string(needed) + ";") == std::string::npos) return "AccessDenied";
  }
  std::ostringstream canonical;
  // The canonical request has the method, the path, an empty query, the signed fields, their names and the body's
  // hash, each on its own line.
  canonical << std::string(request.method_string()) << '\n' << std::string(request.target()) << "\n\n";
  std::istringstream names(signed_names);
  for (std::string name; std::getline(names, name, ';');) canonical << name << ':' << field(request, name) << '\n';
  canonical << '\n' << signed_names << '\n' << payload_hash;
  const std::string scope = parts[2].str() + "/" + parts[3].str() + "/s3/aws4_request";
  const std::string text = "AWS4-HMAC-SHA256\n" + date + "\n" + scope + "\n" + hex(sha256(canonical.str()));
  // The signing key is derived from the secret in four steps: date, region, service and a fixed text.
  const std::string key = hmac(hmac(hmac(hmac("AWS4" + def.secret, parts[2]), parts[3]), "s3"), "aws4_request");
  return hex(hmac(key, text)) == parts[5] ? "" : "SignatureDoesNotMatch";
}

Response answer_of(http::status status, const std::string& body) {
  Response response(status, 11);
  response.body() = body;
  response.prepare_payload();
  return response;
}

Response error_of(http::status status, const std::string& code) {
  return answer_of(status, "<?xml version=\"1.0\"?>\n<Error><Code>" + code + "</Code><Message>no</Message></Error>");
}

}  // namespace

struct S3Server::Impl {
  explicit Impl(S3Server& its_server) : server(&its_server) {}

  asio::awaitable<void> accept();
  template <class Stream>
  asio::awaitable<void> serve(Stream& stream);
  template <class Stream>
  asio::awaitable<bool> misbehave(Stream& stream, S3Behaviour behaviour);
  [[nodiscard]] Response answer(const Request& request, S3Behaviour behaviour) const;
  asio::awaitable<void> open(Tcp::socket socket);

  S3Server* server;
  asio::io_context loop{1};
  Tcp::acceptor acceptor{loop};
  std::optional<asio::ssl::context> tls;
};

asio::awaitable<void> S3Server::Impl::accept() {
  while (true) {
    auto [error, socket] = co_await acceptor.async_accept(kAwaitable);
    if (error) co_return;
    ++server->connections;
    asio::co_spawn(loop, open(std::move(socket)), asio::detached);
  }
}

asio::awaitable<void> S3Server::Impl::open(Tcp::socket socket) {
  if (!tls) co_return co_await serve(socket);
  asio::ssl::stream<Tcp::socket> stream(std::move(socket), *tls);
  const auto [error] = co_await stream.async_handshake(asio::ssl::stream_base::server, kAwaitable);
  if (!error) co_await serve(stream);
}

// Sends an answer that is no HTTP or is incomplete, for the kinds of behaviour that want one. Returns false, and
// sends nothing, for all other kinds.
template <class Stream>
asio::awaitable<bool> S3Server::Impl::misbehave(Stream& stream, S3Behaviour behaviour) {
  std::string text;
  if (behaviour == S3Behaviour::silent) {
    // An hour is longer than any test. The loop is stopped when the server is destroyed.
    asio::steady_timer timer(loop, std::chrono::hours(1));
    co_await timer.async_wait(kAwaitable);
    co_return true;
  }
  if (behaviour == S3Behaviour::too_large) text = "HTTP/1.1 200 OK\r\nContent-Length: 999999999999\r\n\r\nabc";
  if (behaviour == S3Behaviour::truncated) text = "HTTP/1.1 200 OK\r\nContent-Length: 100\r\n\r\nabc";
  if (behaviour == S3Behaviour::no_http) text = "220 mail.example ESMTP\r\n\r\n";
  if (behaviour == S3Behaviour::endless_error) text = "HTTP/1.1 500 No\r\nContent-Length: 999999999\r\n\r\nabc";
  if (text.empty()) co_return false;
  co_await asio::async_write(stream, asio::buffer(text), kAwaitable);
  co_return true;
}

// Answers the requests of one connection, one after the other, until the client leaves or the behaviour ends it.
// `Stream` is a socket, or TLS over one.
template <class Stream>
asio::awaitable<void> S3Server::Impl::serve(Stream& stream) {
  beast::flat_buffer buffer;
  while (true) {
    http::request_parser<http::string_body> parser;
    parser.body_limit(kBodyBytesMax);
    if (std::get<0>(co_await http::async_read_header(stream, buffer, parser, kAwaitable))) co_return;
    if (server->behaviour == S3Behaviour::refuses_at_once) {
      co_await http::async_write(stream, error_of(http::status::forbidden, "AccessDenied"), kAwaitable);
      co_return;
    }
    if (std::get<0>(co_await http::async_read(stream, buffer, parser, kAwaitable))) co_return;
    const Request& request = parser.get();
    if (request.method() == http::verb::get) ++server->gets;
    if (request.method() == http::verb::head) ++server->heads;
    if (request.method() == http::verb::put) ++server->puts;
    const S3Behaviour behaviour = server->behaviour;
    if (co_await misbehave(stream, behaviour)) co_return;
    Response response = answer(request, behaviour);
    // The answer to HEAD has no body, but its Content-Length stays.
    if (request.method() == http::verb::head) response.body().clear();
    if (std::get<0>(co_await http::async_write(stream, response, kAwaitable))) co_return;
    if (behaviour == S3Behaviour::closes_idle) co_return;
  }
}

Response S3Server::Impl::answer(const Request& request, S3Behaviour behaviour) const {
  // These refusals come before the check of the signature, so that they do not depend on it.
  if (behaviour == S3Behaviour::denied) return error_of(http::status::forbidden, "AccessDenied");
  if (behaviour == S3Behaviour::error) return error_of(http::status::internal_server_error, "InternalError");
  if (behaviour == S3Behaviour::no_bucket) return error_of(http::status::not_found, "NoSuchBucket");
  if (behaviour == S3Behaviour::redirect) {
    Response response = error_of(http::status::moved_permanently, "PermanentRedirect");
    response.set(http::field::location, "http://elsewhere.example/");
    return response;
  }
  if (const std::string wrong = wrong_with(request, server->def_); !wrong.empty()) {
    ++server->wrong_signatures;
    return error_of(http::status::forbidden, wrong);
  }
  const std::string target(request.target()), bucket = "/" + server->def_.bucket + "/";
  if (!target.starts_with(bucket)) return error_of(http::status::not_found, "NoSuchBucket");
  const std::string name = target.substr(bucket.size());
  const std::lock_guard lock(server->mutex_);
  if (request.method() == http::verb::put) {
    server->objects_[name].assign(request.body().begin(), request.body().end());
    return answer_of(http::status::ok, "");
  }
  const auto object = server->objects_.find(name);
  if (object == server->objects_.end()) return error_of(http::status::not_found, "NoSuchKey");
  std::string body(object->second.begin(), object->second.end());
  // HTTP is correct here, so only a check of the object's own hash finds the wrong byte.
  if (behaviour == S3Behaviour::lying && !body.empty()) body[body.size() / 2] ^= 1;
  return answer_of(http::status::ok, body);
}

S3Server::S3Server(S3ServerDef def) : def_(std::move(def)), impl_(std::make_unique<Impl>(*this)) {
  if (!def_.certificate.empty()) {
    impl_->tls.emplace(asio::ssl::context::tls_server);
    impl_->tls->use_certificate_chain_file(def_.certificate);
    impl_->tls->use_private_key_file(def_.key, asio::ssl::context::pem);
  }
  const Tcp::endpoint endpoint(asio::ip::address_v4::loopback(), def_.port);
  impl_->acceptor.open(endpoint.protocol());
  impl_->acceptor.set_option(Tcp::acceptor::reuse_address(true));
  impl_->acceptor.bind(endpoint);
  impl_->acceptor.listen();
  port_ = impl_->acceptor.local_endpoint().port();
  asio::co_spawn(impl_->loop, impl_->accept(), asio::detached);
  thread_ = std::thread([this] { impl_->loop.run(); });
}

S3Server::~S3Server() {
  impl_->loop.stop();
  thread_.join();
}

std::string S3Server::url(const std::string& prefix) const {
  return (def_.certificate.empty() ? "http://" : "https://") + host() + "/" + def_.bucket + prefix;
}

std::map<std::string, std::vector<std::uint8_t>> S3Server::objects() const {
  const std::lock_guard lock(mutex_);
  return objects_;
}

void S3Server::set_object(const std::string& name, std::vector<std::uint8_t> bytes) {
  const std::lock_guard lock(mutex_);
  objects_[name] = std::move(bytes);
}

}  // namespace hairnet::support
