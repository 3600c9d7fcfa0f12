// Joins the lobby of a server as an observer, and prints who is there and what happens, for five seconds.
//   join_and_print [ADDRESS]
#include <chrono>
#include <cstdio>
#include <thread>

#include "client/room/connect.hpp"

using namespace hairnet;

int main(int argc, char** argv) {
  link::LinkOptions options;
  options.core.role = wire::Role::observer;
  if (argc > 1) {
    const Result<link::Address> address = link::parse_address(argv[1]);
    if (!address) return std::fprintf(stderr, "%s\n", address.error().c_str()), 2;
    options.server = *address;
  }
  const auto joined = room::connect(options);
  if (!joined) return std::fprintf(stderr, "%s\n", joined.error().c_str()), 1;
  room::Room& lobby = **joined;

  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(5);
  while (std::chrono::steady_clock::now() < end && lobby.state() != room::State::closed) {
    // The room takes what has arrived only here, so a program calls this for each picture.
    lobby.advance();
    for (const room::Event& event : lobby.take_events()) std::puts(describe(event).c_str());
    std::this_thread::sleep_for(std::chrono::milliseconds(14));
  }
  for (const auto& [number, member] : lobby.members()) {
    const char* hairstyle = member->groom ? member->groom->name.c_str() : "a hairstyle on its way";
    std::printf("member %u has %s\n", number, hairstyle);
  }
}
