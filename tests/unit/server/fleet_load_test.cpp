#include <gtest/gtest.h>

#include "server/app/fleet.hpp"
#include "server/transport/io_loop.hpp"

namespace hairnet::server {
namespace {

class FleetLoad : public testing::Test {
 protected:
  FleetLoad() {
    config_.sessions.character_count_max = 100;
    config_.sessions.room_count_max = 3;
    fleet_ = *Fleet::create(config_, 7420, loop_, metrics_);
  }
  ServerLoad announced(bool takes_clients) {
    fleet_->poll(takes_clients, {}, 1);
    return fleet_->directory().servers().at(0).load;
  }

  Config config_;
  IoLoop loop_;
  Metrics metrics_;
  std::unique_ptr<Fleet> fleet_;
};

TEST_F(FleetLoad, says_how_many_characters_a_server_still_takes) {
  metrics_.tick.gauges.characters[LevelIndex::high].set(30);
  metrics_.tick.gauges.characters[LevelIndex::low].set(10);
  EXPECT_EQ(announced(true).characters, 40u);
  EXPECT_EQ(announced(true).free_characters, 60u);
}

TEST_F(FleetLoad, gives_no_new_room_to_a_server_that_takes_no_client) {
  EXPECT_EQ(announced(false).free_characters, 0u);
  EXPECT_EQ(announced(true).free_characters, 100u);
}

TEST_F(FleetLoad, gives_no_new_room_to_a_server_that_has_all_the_rooms_it_may_have) {
  metrics_.fleet.gauges.rooms_owned.set(2);
  EXPECT_EQ(announced(true).free_characters, 100u);
  metrics_.fleet.gauges.rooms_owned.set(3);
  EXPECT_EQ(announced(true).free_characters, 0u);
}

// The tick wants five times the time it has. As long as coarser levels make room, the server announces
// kAnnouncedShareMin and still takes rooms; 0 means that it takes none.
TEST_F(FleetLoad, is_whole_while_not_even_the_coarsest_levels_fit) {
  metrics_.tick.gauges.budget_available_seconds.set(1);
  metrics_.tick.gauges.budget_wanted_seconds.set(5);
  EXPECT_DOUBLE_EQ(announced(true).free_share, 1.0 / 16) << "more characters only mean coarser hair";
  metrics_.tick.gauges.budget_over.set(1);
  EXPECT_EQ(announced(true).free_share, 0.0);
}

}  // namespace
}  // namespace hairnet::server
