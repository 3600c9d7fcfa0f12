#include "client/link/page_request.hpp"

#include <boost/asio.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <utility>

namespace hairnet::link {
namespace {

namespace http = boost::beast::http;
using boost::system::error_code;

// Bounds the memory for the answer of a server that is not ours. Our page is much smaller.
constexpr std::size_t kPageBytesMax = 8u << 10;
constexpr unsigned kHttp11 = 11;

// Returns one line if there is no page.
asio::awaitable<std::string> exchange(Socket& socket, std::string_view path, std::string& text) {
  http::request<http::empty_body> request(http::verb::get, path, kHttp11);
  request.set(http::field::host, socket.options().server.authority());
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

asio::awaitable<PageRequest::Answer> PageRequest::get(std::string_view path) {
  Answer answer;
  answer.error = co_await socket_.open();
  answer.is_reachable = answer.error.empty();
  if (!answer.is_reachable) co_return answer;
  answer.server = socket_.remote_address();
  answer.error = co_await exchange(socket_, path, answer.text);
  socket_.close();
  co_return answer;
}

}  // namespace hairnet::link
