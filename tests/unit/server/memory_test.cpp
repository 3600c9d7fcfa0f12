#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <thread>
#include <vector>

#include "server/app/memory_watch.hpp"
#include "server/app/server.hpp"
#include "server/threading/memory_reserve.hpp"
#include "tests/support/own_allocator.hpp"
#include "tests/unit/server/build_quickly.hpp"
#include "tests/unit/server/fake_client.hpp"
#include "tests/unit/server/small_groom.hpp"

namespace hairnet::server {
namespace {

using testing::Contains;
using testing::IsEmpty;

constexpr std::int64_t kMs = 1'000'000, kS = 1'000'000'000;
// The reserve of these tests, 1 MiB: memory that the program holds to give it up when there is no other.
constexpr std::size_t kReserve_bytes = std::size_t{1} << 20;

// Allocations of this program fail as a test wishes (tests/support/own_allocator.hpp): one that is counted down to, or
// all above a size.
class MemoryReserveTest : public testing::Test {
 protected:
  ~MemoryReserveTest() override {
    own_allocator::until_failure = own_allocator::kNever;
    own_allocator::failing_bytes = std::numeric_limits<std::size_t>::max();
  }
  static void allocate(std::size_t bytes) { std::vector<char>(bytes).back() = 1; }
};

TEST_F(MemoryReserveTest, an_allocation_that_fails_takes_the_reserve_and_succeeds) {
  MemoryReserve reserve(kReserve_bytes);
  EXPECT_FALSE(reserve.is_spent());
  own_allocator::until_failure = 1;
  // The reserve is given up when an allocation fails, and the second try finds its memory free.
  EXPECT_NO_THROW(allocate(100));
  EXPECT_TRUE(reserve.is_spent());
  EXPECT_TRUE(reserve.refill());
  EXPECT_FALSE(reserve.is_spent());
}

// All allocations of more than 1000 bytes fail, before and after the reserve is given up.
TEST_F(MemoryReserveTest, the_owner_gets_bad_alloc_when_the_reserve_does_not_help) {
  MemoryReserve reserve(kReserve_bytes);
  own_allocator::failing_bytes = 1000;
  EXPECT_THROW(allocate(2000), std::bad_alloc);
  EXPECT_TRUE(reserve.is_spent());
}

// Code that can go on without the memory says so by MayFail, also within other such code. The reserve is for code that
// cannot.
TEST_F(MemoryReserveTest, an_allocation_that_may_fail_leaves_the_reserve_alone) {
  MemoryReserve reserve(kReserve_bytes);
  own_allocator::failing_bytes = 1000;
  {
    const MemoryReserve::MayFail outer;
    { const MemoryReserve::MayFail inner; }
    EXPECT_THROW(allocate(2000), std::bad_alloc);
  }
  EXPECT_FALSE(reserve.is_spent());
  EXPECT_THROW(allocate(2000), std::bad_alloc);
  EXPECT_TRUE(reserve.is_spent());
}

TEST_F(MemoryReserveTest, another_thread_waits_until_there_is_memory) {
  MemoryReserve reserve(kReserve_bytes);
  own_allocator::failing_bytes = 1000;
  const long failures = own_allocator::failure_count;
  std::optional<bool> has_got;
  std::thread other([&has_got] {
    try {
      allocate(2000);
      has_got = true;
    } catch (const std::bad_alloc&) {
      has_got = false;
    }
  });
  // The first two failures are those that take the reserve and try again. More show that the thread waits.
  while (own_allocator::failure_count < failures + 5) std::this_thread::yield();
  own_allocator::failing_bytes = std::numeric_limits<std::size_t>::max();
  other.join();
  EXPECT_EQ(has_got, true);
}

TEST_F(MemoryReserveTest, without_a_reserve_allocations_fail_as_usual) {
  { const MemoryReserve former(kReserve_bytes); }
  own_allocator::until_failure = 1;
  EXPECT_THROW(allocate(100), std::bad_alloc);
}

// A watch over a made-up process, whose bytes the test sets: `resident_` is what the system has given it, `allocated_`
// the part in use, and `kept_` the unused part that the allocator cannot give back.
class MemoryWatchTest : public testing::Test {
 protected:
  MemoryWatch make(std::size_t bytes_max) {
    ProcessMemory memory;
    memory.bytes_max = bytes_max;
    memory.resident_bytes = [this] { return resident_; };
    memory.allocated_bytes = [this] { return allocated_; };
    memory.give_back = [this] {
      ++given_back_;
      resident_ = allocated_ + kept_;
    };
    return {std::move(memory), metrics_.program, metrics_.program_counters};
  }

  Metrics metrics_;
  std::size_t resident_ = 0, allocated_ = 0, kept_ = 0;
  int given_back_ = 0;
};

TEST_F(MemoryWatchTest, memory_is_full_from_the_bound_until_it_is_well_below) {
  MemoryWatch watch = make(1000);
  std::int64_t now_ns = 0;
  const auto is_full_at = [&](std::size_t bytes) {
    resident_ = allocated_ = bytes;
    watch.poll(now_ns += kMs);
    EXPECT_EQ(metrics_.program.memory_full.value(), watch.is_full() ? 1 : 0);
    return watch.is_full();
  };
  // Memory that is full stays so until it is below 0.95 of the bound (MemoryWatch::kRefillShare), or the state would
  // flicker at the bound.
  EXPECT_FALSE(is_full_at(999));
  EXPECT_TRUE(is_full_at(1000));
  EXPECT_TRUE(is_full_at(960));
  EXPECT_FALSE(is_full_at(940));
  EXPECT_FALSE(is_full_at(960));
  EXPECT_EQ(metrics_.program.memory_max_bytes.value(), 1000);
}

TEST_F(MemoryWatchTest, without_a_bound_memory_is_never_full) {
  MemoryWatch watch = make(0);
  resident_ = std::size_t{1} << 50;
  watch.poll(0);
  EXPECT_FALSE(watch.is_full());
}

// A reserve of more bytes than any machine has is spent from the start, and no poll can refill it.
TEST_F(MemoryWatchTest, a_use_of_the_reserve_counts_once_however_often_it_cannot_be_refilled) {
  if (HAIRNET_SANITIZED) GTEST_SKIP() << "sanitizers end a program that asks for so much";
  MemoryReserve reserve(std::size_t{1} << 62);
  ProcessMemory memory;
  memory.reserve = &reserve;
  MemoryWatch watch(std::move(memory), metrics_.program, metrics_.program_counters);
  for (int i = 1; i <= 3; ++i) {
    watch.poll(i * kS);
    EXPECT_TRUE(watch.is_full());
    EXPECT_EQ(metrics_.program_counters.memory_reserve_used.value(), 1u);
  }
}

TEST_F(MemoryWatchTest, unused_memory_is_given_back_after_a_peak_and_not_again_and_again) {
  // Memory that was freed is given back to the system when it exceeds 32 MiB (MemoryWatch::kGiveBack_bytes). `kept_` is
  // the part that the allocator cannot give back: trying again every two seconds would cost time for nothing.
  constexpr std::size_t kMib = std::size_t{1} << 20;
  MemoryWatch watch = make(0);
  std::int64_t now_ns = 0;
  const auto poll_for_a_minute = [&] {
    const int before = given_back_;
    for (int i = 0; i < 60; ++i) watch.poll(now_ns += kS);
    return given_back_ - before;
  };
  resident_ = 20 * kMib;
  allocated_ = 15 * kMib;
  kept_ = 5 * kMib;
  poll_for_a_minute();
  allocated_ = 500 * kMib;
  resident_ = 510 * kMib;
  EXPECT_EQ(poll_for_a_minute(), 0);
  // The program frees 480 MiB, which the allocator keeps; 60 MiB of these cannot be given back.
  allocated_ = 20 * kMib;
  kept_ = 60 * kMib;
  EXPECT_EQ(poll_for_a_minute(), 1);
  EXPECT_EQ(resident_, 80 * kMib);
  kept_ = 0;
  // The allocator has given memory back by itself.
  resident_ = 25 * kMib;
  EXPECT_EQ(poll_for_a_minute(), 0);
  resident_ = 90 * kMib;
  EXPECT_EQ(poll_for_a_minute(), 1);
}

class ServerMemoryTest : public MemoryReserveTest {
 protected:
  ServerMemoryTest() {
    Config config;
    config.workers = 1;
    ProcessMemory memory;
    // The program's memory is what the test writes into `resident_`: 10 is little, and 1000 is full.
    memory.bytes_max = 1000;
    memory.resident_bytes = [this] { return resident_; };
    memory.reserve = &reserve_;
    auto created = Server::create(config, metrics_, now_ns_, nullptr, build_quickly, std::move(memory));
    EXPECT_TRUE(created);
    server_ = std::move(*created);
  }
  void run_ms(int count) {
    for (int i = 0; i < count; ++i) server_->poll(now_ns_ += kMs);
  }
  void upload_and_add(FakeClient& client) {
    client.hello(now_ns_);
    client.upload(bytes_, hash_, now_ns_);
    client.send(wire::AddCharacter{1, hash_, LevelIndex::low}, now_ns_);
  }
  [[nodiscard]] Pose pose() const {
    return rigid_pose({Quat::Identity(), {0.1 * std::sin(5e-9 * static_cast<double>(now_ns_ % kS)), 1.6, 0}});
  }

  Metrics metrics_;
  std::int64_t now_ns_ = 1'000 * kS;
  std::size_t resident_ = 10;
  std::vector<std::uint8_t> bytes_ = wire::encode_groom(small_groom());
  wire::GroomHash hash_ = wire::hash_groom(bytes_);
  MemoryReserve reserve_{kReserve_bytes};
  std::unique_ptr<Server> server_;
};

TEST_F(ServerMemoryTest, a_server_with_full_memory_refuses_what_needs_more_and_goes_on) {
  FakeClient early(*server_, now_ns_);
  upload_and_add(early);
  run_ms(200);
  resident_ = 1000;
  run_ms(10);
  EXPECT_TRUE(server_->is_memory_full());
  FakeClient late(*server_, now_ns_);
  late.hello(now_ns_);
  const auto goodbyes = late.connection->all<wire::Goodbye>();
  ASSERT_EQ(goodbyes.size(), 1u);
  EXPECT_EQ(goodbyes[0].reason, wire::GoodbyeReason::server_full);
  EXPECT_FALSE(goodbyes[0].detail.empty());
  EXPECT_EQ(metrics_.session.sessions_refused_memory.value(), 1u);
  early.send(wire::AddCharacter{2, hash_, LevelIndex::low}, now_ns_);
  early.send(wire::GroomOffer{wire::GroomHash{1}, 100}, now_ns_);
  early.send(wire::GroomRequest{hash_, 0}, now_ns_);
  EXPECT_EQ(early.errors(), std::vector(3, wire::ErrorReason::limit_exceeded));
  EXPECT_EQ(metrics_.session.messages_refused_memory.value(), 3u);
  const std::size_t frames = early.frames(1).size();
  for (int i = 0; i < 10; ++i) {
    early.pose(1, pose(), now_ns_);
    run_ms(20);
  }
  // In 200 ms there are six ticks of 30 Hz, of which a few frames may be missing.
  EXPECT_GT(early.frames(1).size(), frames + 3);
  resident_ = 10;
  run_ms(10);
  early.send(wire::AddCharacter{2, hash_, LevelIndex::low}, now_ns_);
  EXPECT_EQ(metrics_.session.messages_refused_memory.value(), 3u);
}

TEST_F(ServerMemoryTest, full_memory_evicts_unused_grooms_and_ends_uploads_and_slow_readers) {
  FakeClient first(*server_, now_ns_);
  upload_and_add(first);
  run_ms(200);
  EXPECT_EQ(server_->grooms().groom_count(), 1u);
  first.send(wire::Goodbye{wire::GoodbyeReason::client_leaves, ""}, now_ns_);
  FakeClient uploader(*server_, now_ns_);
  uploader.hello(now_ns_);
  uploader.send(wire::GroomOffer{wire::GroomHash{7}, 1000}, now_ns_);
  uploader.send(wire::GroomChunk{wire::GroomHash{7}, 0, std::vector<std::uint8_t>(500)}, now_ns_);
  EXPECT_EQ(server_->grooms().upload_bytes(), 500u);
  resident_ = 1000;
  run_ms(10);
  EXPECT_EQ(server_->grooms().groom_count(), 0u);
  EXPECT_EQ(server_->grooms().upload_bytes(), 0u);
  EXPECT_THAT(uploader.errors(), Contains(wire::ErrorReason::limit_exceeded));
  EXPECT_EQ(metrics_.session.sessions_closed_by_server_memory.value(), 0u);
}

// A session lives again and again; in its n-th life the n-th allocation fails. No failure may reach another session.
// The loop ends with the life that needs fewer allocations than n.
TEST_F(ServerMemoryTest, whichever_allocation_fails_only_the_session_that_asked_for_memory_ends) {
  FakeClient bystander(*server_, now_ns_);
  upload_and_add(bystander);
  run_ms(200);
  long lives = 0, ended = 0, failed = 0;
  for (long number = 1;; ++number) {
    const std::uint64_t ended_before = metrics_.session.sessions_closed_by_server_memory.value();
    const std::size_t frames_before = bystander.connection->all<wire::FrameBatch>().size();
    const long failures = own_allocator::failure_count;
    bystander.pose(1, pose(), now_ns_);
    {
      FakeClient client(*server_, now_ns_);
      own_allocator::until_failure = number;
      client.hello(now_ns_);
      client.upload(bytes_, hash_, now_ns_);
      client.send(wire::AddCharacter{1, hash_, LevelIndex::low}, now_ns_);
      client.send(wire::AddCharacter{2, hash_, LevelIndex::low}, now_ns_);
      client.pose(1, pose(), now_ns_);
      client.send(wire::Observe{}, now_ns_);
      client.send(wire::SetMaterial{1, {}}, now_ns_);
      client.send(wire::GroomRequest{hash_, 0}, now_ns_);
      client.send(wire::RemoveCharacter{2}, now_ns_);
      run_ms(34);
      own_allocator::until_failure = own_allocator::kNever;
      ended += static_cast<long>(metrics_.session.sessions_closed_by_server_memory.value() - ended_before);
      client.send(wire::Goodbye{wire::GoodbyeReason::client_leaves, ""}, now_ns_);
    }
    run_ms(4);
    ++lives;
    ASSERT_GT(bystander.connection->all<wire::FrameBatch>().size(), frames_before);
    ASSERT_EQ(server_->session_count(), 1u);
    ASSERT_FALSE(server_->is_memory_full());
    if (own_allocator::failure_count == failures) break;
    ++failed;
  }
  // A life needs more than a hundred allocations, and some failures end the session: the loop has not ended early.
  EXPECT_GT(failed, 100);
  EXPECT_GT(ended, 10);
  EXPECT_EQ(lives, failed + 1);
  EXPECT_THAT(bystander.errors(), IsEmpty());
  EXPECT_GE(metrics_.program_counters.memory_reserve_used.value(), static_cast<std::uint64_t>(failed));
}

}  // namespace
}  // namespace hairnet::server
