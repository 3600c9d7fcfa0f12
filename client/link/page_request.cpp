#include "client/link/page_request.hpp"

#include <boost/asio.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <utility>

#include "client/link/socket.hpp"

namespace hairnet::link {
namespace {

namespace http = boost::beast::http;
using boost::system::error_code;

constexpr std::size_t kPageBytesMax = 8u << 10;
constexpr unsigned kHttp11 = 11;

// Returns one line if there is no page.
template <class Socket>
asio::awaitable<std::string> exchange(Socket& socket, const StreamOptions& options, std::string_view path,
                                      std::string& text) {
  http::request<http::empty_body> request(http::verb::get, path, kHttp11);
  request.set(http::field::host, options.server.authority());
  request.set(http::field::user_agent, "hairnet");
  request.set(http::field::connection, "close");
  error_code error;
  const auto redirect = [&] { return asio::redirect_error(asio::use_awaitable, error); };
  co_await http::async_write(socket, request, redirect());
  http::response_parser<http::string_body> answer;
  answer.body_limit(kPageBytesMax);
  boost::beast::flat_buffer buffer;
  if (!error) co_await http::async_read(socket, buffer, answer, redirect());
  if (error) co_return "no page: " + error.message();
  if (answer.get().result() != http::status::ok)
    co_return "it answers " + std::to_string(answer.get().result_int()) + " to " + std::string(path);
  text = std::move(answer.get().body());
  co_return std::string();
}

}  // namespace

PageRequest::PageRequest(asio::io_context& io, StreamOptions options)
    : options_(std::move(options)),
      context_(make_tls_context()),
      fault_(options_.server.encrypted() ? configure(context_, options_.tls) : std::string()),
      socket_(io, context_),
      lookup_(io.get_executor()) {}

asio::awaitable<std::string> PageRequest::open() {
  if (!options_.server.encrypted()) co_return co_await connect_socket(socket_.next_layer(), lookup_, options_);
  if (!fault_.empty()) co_return fault_;
  std::string fault = co_await connect_socket(socket_.next_layer(), lookup_, options_);
  if (fault.empty()) fault = co_await tls_handshake(socket_, options_);
  co_return fault;
}

asio::awaitable<PageRequest::Answer> PageRequest::get(std::string_view path) {
  Answer answer;
  answer.fault = co_await open();
  answer.is_reachable = answer.fault.empty();
  if (!answer.is_reachable) co_return answer;
  error_code error;
  answer.server = socket_.next_layer().remote_endpoint(error).address();
  if (options_.server.encrypted())
    answer.fault = co_await exchange(socket_, options_, path, answer.text);
  else
    answer.fault = co_await exchange(socket_.next_layer(), options_, path, answer.text);
  if (error) answer.fault = "no page: " + error.message();
  close();
  co_return answer;
}

void PageRequest::cancel() {
  lookup_.cancel();
  close();
}

void PageRequest::close() {
  error_code ignored;
  socket_.next_layer().close(ignored);
}

}  // namespace hairnet::link
