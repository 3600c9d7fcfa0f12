#include "tests/whole/owner_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace hairnet::whole {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr std::int64_t kMs_ns = 1'000'000;

// Server 1 has the room from 100 ms on under claim 10, server 2 from 9100 ms on under claim 20. The arguments of
// claimed() are the server, the room, the claim and the time. Those of received() are the client, the server, the room,
// the stamp and the arrival.
OwnerCheck check_with_claims() {
  OwnerCheck check;
  check.claimed(1, "hall", 10, 100 * kMs_ns);
  check.claimed(2, "hall", 20, 9100 * kMs_ns);
  return check;
}

TEST(OwnerCheck, accepts_one_owner_after_the_other) {
  OwnerCheck check = check_with_claims();
  check.received(7, 1, "hall", 200 * kMs_ns, 201 * kMs_ns);
  check.received(8, 1, "hall", 9000 * kMs_ns, 9001 * kMs_ns);
  check.received(7, 2, "hall", 9200 * kMs_ns, 9201 * kMs_ns);
  check.claimed(1, "hall", 30, 9300 * kMs_ns);
  check.received(7, 1, "hall", 9400 * kMs_ns, 9401 * kMs_ns);
  EXPECT_THAT(check.take_faults(), IsEmpty());
  EXPECT_EQ(check.owners, 3u);
  EXPECT_EQ(check.owner("hall")->server, 1u);
  EXPECT_EQ(check.owner("hall")->claim, 30);
  EXPECT_EQ(check.claimed_after("hall", 9100 * kMs_ns), 9300 * kMs_ns);
  EXPECT_EQ(check.frames_after("hall", 100 * kMs_ns), 9200 * kMs_ns);
  EXPECT_FALSE(check.claimed_after("hall", 9300 * kMs_ns));
}

TEST(OwnerCheck, sees_two_owners_by_the_frames_of_two_clients) {
  OwnerCheck check = check_with_claims();
  check.received(8, 2, "hall", 9200 * kMs_ns, 9201 * kMs_ns);
  check.received(7, 1, "hall", 9201 * kMs_ns, 9202 * kMs_ns);
  EXPECT_THAT(check.take_faults(),
              ElementsAre(HasSubstr("server 1 (claim 10) sends frames of hall after server 2 (claim 20)")));
  check.received(7, 1, "hall", 9203 * kMs_ns, 9204 * kMs_ns);
  EXPECT_THAT(check.take_faults(), IsEmpty()) << "it is told once";
  // Server 2 began at 9200 ms, and server 1 still sent at 9203 ms.
  EXPECT_EQ(check.overlap_ns_max, 3 * kMs_ns);
}

TEST(OwnerCheck, sees_two_owners_in_any_order_of_arrival) {
  OwnerCheck check = check_with_claims();
  check.received(7, 1, "hall", 9201 * kMs_ns, 9202 * kMs_ns);
  check.received(8, 2, "hall", 9200 * kMs_ns, 9203 * kMs_ns);
  EXPECT_THAT(check.take_faults(), ElementsAre(HasSubstr("two owners")));
}

TEST(OwnerCheck, sees_an_older_owner_after_a_newer_one_at_one_client) {
  OwnerCheck check = check_with_claims();
  check.received(7, 2, "hall", 9200 * kMs_ns, 9201 * kMs_ns);
  check.received(7, 1, "hall", 9000 * kMs_ns, 9202 * kMs_ns);
  EXPECT_THAT(check.take_faults(), ElementsAre(HasSubstr("client 7 gets frames of hall under claim 10")));
}

TEST(OwnerCheck, counts_frames_that_were_in_flight) {
  OwnerCheck check = check_with_claims();
  check.received(8, 2, "hall", 9200 * kMs_ns, 9201 * kMs_ns);
  check.received(7, 1, "hall", 9000 * kMs_ns, 9203 * kMs_ns);
  EXPECT_THAT(check.take_faults(), IsEmpty());
  EXPECT_EQ(check.in_flight, 1u);
  // The packet arrived at 9203 ms; server 2 began at 9200 ms.
  EXPECT_EQ(check.in_flight_ns_max, 3 * kMs_ns);
}

TEST(OwnerCheck, sees_frames_without_a_claim) {
  OwnerCheck check = check_with_claims();
  // Server 3 has no claim at all, server 2 none before 9100 ms, and nobody one of the yard.
  check.received(7, 3, "hall", 9200 * kMs_ns, 9201 * kMs_ns);
  check.received(7, 2, "hall", 9000 * kMs_ns, 9201 * kMs_ns);
  check.received(7, 1, "yard", 9200 * kMs_ns, 9201 * kMs_ns);
  EXPECT_EQ(check.take_faults().size(), 3u);
}

TEST(OwnerCheck, sees_a_claim_that_two_servers_have_won) {
  OwnerCheck check = check_with_claims();
  check.claimed(3, "hall", 20, 9500 * kMs_ns);
  EXPECT_THAT(check.take_faults(), ElementsAre(HasSubstr("have both won claim 20 of hall")));
}

}  // namespace
}  // namespace hairnet::whole
