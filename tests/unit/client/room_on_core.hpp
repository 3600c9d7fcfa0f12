#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <utility>
#include <variant>
#include <vector>

#include "client/room/room.hpp"
#include "tests/unit/client/link_core_driver.hpp"

namespace hairnet::room {

// Gives each test a room whose connection is a LinkCoreDriver, so that the test is its server and its clock.
class RoomOnCore : public ::testing::Test {
 protected:
  RoomOnCore() { make_room({}); }
  // Makes the room again, on the same core. A room passes `observe` to its server.
  void make_room(const wire::Observe& observe) {
    auto owned = std::make_unique<link::CoreConversation>(d.core);
    conversation = owned.get();
    conversation->set_now(d.now_ns);
    room = std::make_unique<Room>(std::move(owned), observe);
  }
  // Lets this time pass, and makes the room process what the driver has sent it until now.
  void advance(std::int64_t ms = 0) {
    d.pass(ms * link::kMs);
    conversation->set_now(d.now_ns);
    room->advance();
  }
  // Returns the events of one kind since the last call. All other events are dropped.
  template <class T>
  std::vector<T> events() {
    std::vector<T> found;
    for (const Event& event : room->take_events()) {
      EXPECT_NE(describe(event), "");
      if (const auto* e = std::get_if<T>(&event)) found.push_back(*e);
    }
    return found;
  }
  // Returns the messages of one kind that the client sends now. All others are dropped.
  template <class T>
  std::vector<T> sent() {
    std::vector<T> found;
    for (wire::Message& message : d.take_all()) {
      if (auto* m = std::get_if<T>(&message)) found.push_back(std::move(*m));
    }
    return found;
  }

  link::LinkCoreDriver d;
  // The room owns it.
  link::CoreConversation* conversation = nullptr;
  std::unique_ptr<Room> room;
};

}  // namespace hairnet::room
