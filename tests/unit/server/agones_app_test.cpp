#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/app/agones.hpp"
#include "server/transport/io_loop.hpp"

namespace hairnet::server {
namespace {

using testing::HasSubstr;

class AgonesChoice : public testing::Test {
 protected:
  Result<std::unique_ptr<Agones>> create(UseAgones use, const char* port) {
    config_.fleet.agones = use;
    return Agones::create(config_, port, loop_, metrics_);
  }
  Config config_;
  IoLoop loop_;
  Metrics metrics_;
};

TEST_F(AgonesChoice, is_by_the_setting_and_the_port_that_agones_sets) {
  EXPECT_EQ(*create(UseAgones::off, "9358"), nullptr);
  EXPECT_EQ(*create(UseAgones::automatic, nullptr), nullptr);
  EXPECT_NE(*create(UseAgones::automatic, "9358"), nullptr);
  EXPECT_NE(*create(UseAgones::on, nullptr), nullptr);
}

TEST_F(AgonesChoice, refuses_a_port_that_is_none_in_one_line) {
  EXPECT_THAT(create(UseAgones::on, "http://localhost").error(), HasSubstr("AGONES_SDK_HTTP_PORT"));
  EXPECT_THAT(create(UseAgones::automatic, "").error(), HasSubstr("AGONES_SDK_HTTP_PORT"));
}

TEST_F(AgonesChoice, refuses_to_ask_for_an_address_where_nobody_answers) {
  config_.fleet.address = FleetConfig::kAddressOfAgones;
  EXPECT_THAT(create(UseAgones::automatic, nullptr).error(), HasSubstr("AGONES_SDK_HTTP_PORT is not set"));
  EXPECT_NE(*create(UseAgones::on, nullptr), nullptr);
}

}  // namespace
}  // namespace hairnet::server
