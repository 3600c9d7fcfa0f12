#include "tests/whole/loopback.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

namespace hairnet::whole {

std::uint16_t free_port() {
  const int listener = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ::bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof(address));
  socklen_t length = sizeof(address);
  ::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &length);
  ::close(listener);
  return ntohs(address.sin_port);
}

std::string get(const std::string& address, std::uint16_t port, const std::string& path) {
  const int peer = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const timeval second{.tv_sec = 1, .tv_usec = 0};
  ::setsockopt(peer, SOL_SOCKET, SO_RCVTIMEO, &second, sizeof(second));
  // This time-out is also that of connect().
  ::setsockopt(peer, SOL_SOCKET, SO_SNDTIMEO, &second, sizeof(second));
  sockaddr_in to{};
  to.sin_family = AF_INET;
  ::inet_pton(AF_INET, address.c_str(), &to.sin_addr);
  to.sin_port = htons(port);
  std::string answer;
  if (::connect(peer, reinterpret_cast<const sockaddr*>(&to), sizeof(to)) == 0) {
    const std::string request = "GET " + path + " HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
    ::send(peer, request.data(), request.size(), MSG_NOSIGNAL);
    char piece[4096];
    for (ssize_t count = 0; (count = ::recv(peer, piece, sizeof(piece), 0)) > 0;)
      answer.append(piece, static_cast<std::size_t>(count));
  }
  ::close(peer);
  const std::size_t body = answer.find("\r\n\r\n");
  return body == std::string::npos ? "" : answer.substr(body + 4);
}

}  // namespace hairnet::whole
