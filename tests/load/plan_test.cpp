#include "tests/load/plan.hpp"

#include <gmock/gmock.h>

namespace hairnet::load {
namespace {

using testing::HasSubstr;

TEST(Stage, has_every_setting_of_its_text) {
  const auto stage = parse_stage(
      "spike:2.5s:name=rush,clients=100,characters=3,level=high+low,churn=2.5,storm=25%,warm=500ms,measured=no,"
      "attack=wind,slow=2,flood=10%,malformed=1,silent=0,half_open=3",
      nullptr);
  ASSERT_TRUE(stage) << stage.error();
  EXPECT_EQ(stage->kind, StageKind::spike);
  EXPECT_EQ(stage->name, "rush");
  EXPECT_DOUBLE_EQ(stage->duration_s, 2.5);
  EXPECT_EQ(stage->clients, 100u);
  EXPECT_EQ(stage->characters, 3u);
  EXPECT_EQ(stage->levels, (std::vector{LevelIndex::high, LevelIndex::low}));
  EXPECT_DOUBLE_EQ(stage->churn_hz, 2.5);
  EXPECT_DOUBLE_EQ(stage->storm_share, 0.25);
  EXPECT_DOUBLE_EQ(stage->warm_s, 0.5);
  EXPECT_FALSE(stage->measured);
  EXPECT_EQ(stage->attack, Attack::wind);
  // The indices are those of Misbehaviour: 2 slow clients, 10 % of the 100 clients that flood, 3 half-open ones.
  EXPECT_EQ(stage->misbehaving[0].of(stage->clients), 2u);
  EXPECT_EQ(stage->misbehaving[1].of(stage->clients), 10u);
  EXPECT_EQ(stage->misbehaving[4].of(stage->clients), 3u);
}

// A user writes the population once, and each stage then states only what changes. Events that went on unasked would
// disturb the later stages.
TEST(Stage, takes_over_population_but_not_events_of_the_previous_stage) {
  const auto first =
      parse_stage("ramp:5s:clients=8,characters=4,level=low,churn=1,storm=0.5,slow=1,attack=big,warm=1s", nullptr);
  ASSERT_TRUE(first) << first.error();
  EXPECT_FALSE(first->measured);
  const auto second = parse_stage("soak:10m", &*first);
  ASSERT_TRUE(second) << second.error();
  EXPECT_EQ(second->clients, 8u);
  EXPECT_EQ(second->characters, 4u);
  EXPECT_EQ(second->levels, std::vector{LevelIndex::low});
  // The slow client belongs to the population, which is the same again.
  EXPECT_EQ(second->misbehaving[0].of(8), 1u);
  EXPECT_EQ(second->churn_hz, 0);
  EXPECT_EQ(second->storm_share, 0);
  EXPECT_EQ(second->warm_s, 0);
  EXPECT_FALSE(second->attack);
  EXPECT_TRUE(second->measured);
  EXPECT_DOUBLE_EQ(second->duration_s, 600);
}

TEST(Stage, text_reads_back_the_same) {
  const auto stage =
      parse_stage("steady:1m:clients=7,characters=2,level=medium,churn=0.5,flood=15%,half_open=2,attack=body", nullptr);
  ASSERT_TRUE(stage) << stage.error();
  const auto again = parse_stage(to_text(*stage), nullptr);
  ASSERT_TRUE(again) << again.error();
  EXPECT_EQ(to_text(*again), to_text(*stage));
}

TEST(Stage, refuses_invalid_text_with_one_line) {
  const std::vector<std::pair<const char*, const char*>> bad{{"", "KIND:DURATION"},
                                                             {"steady", "KIND:DURATION"},
                                                             {"steady:1s:clients=1:x", "KIND:DURATION"},
                                                             {"jump:1s", "not one of ramp"},
                                                             {"steady:1", "not a duration"},
                                                             {"steady:-1s", "not a duration"},
                                                             {"steady:nans", "not a duration"},
                                                             {"steady:1000h", "not a duration"},
                                                             {"steady:1ms", "less than 100ms"},
                                                             {"steady:1s:clients", "not KEY=VALUE"},
                                                             {"steady:1s:clients=x", "not a number"},
                                                             {"steady:1s:clients=-1", "not a number"},
                                                             {"steady:1s:clients=1.5", "whole number"},
                                                             {"steady:1s:clients=1e9", "not a number"},
                                                             {"steady:1s:characters=0", "not a number"},
                                                             {"steady:1s:clients=1,clients=2", "given twice"},
                                                             {"steady:1s:level=highest", "not one of high"},
                                                             {"steady:1s:storm=120%", "not a number"},
                                                             {"steady:1s:churn=nan", "not a number"},
                                                             {"steady:1s:name=A B", "a name has"},
                                                             {"steady:1s:measured=maybe", "not yes or no"},
                                                             {"steady:1s:slow=x%", "not a number"},
                                                             {"steady:1s:attack=x", "not one of zigzag"},
                                                             {"steady:1s:warm=1s", "all warm-up"},
                                                             {"steady:1s:colour=red", "unknown key"}};
  for (const auto& [text, error] : bad) {
    const auto stage = parse_stage(text, nullptr);
    ASSERT_FALSE(stage) << text;
    EXPECT_THAT(stage.error(), HasSubstr(error)) << text;
    EXPECT_EQ(stage.error().find('\n'), std::string::npos) << text;
  }
}

TEST(Plan, reads_back_what_it_writes) {
  auto plan = parse_plan(R"({"seed": 7, "pose_hz": 90, "grooms": ["made:bob"], "motions": ["made:nod"], "room_size": 8,
    "touch_share": 0.5, "props_share": 0.25, "observe": "4", /* a comment */ "stages": ["ramp:1s:clients=3", "steady:2s", "steady:2s"], "require": ["errors==0"]})");
  ASSERT_TRUE(plan) << plan.error();
  EXPECT_EQ(plan->seed, 7u);
  EXPECT_DOUBLE_EQ(plan->touch_share, 0.5);
  EXPECT_DOUBLE_EQ(plan->props_share, 0.25);
  EXPECT_EQ(plan->stages[2].clients, 3u);
  // The second stage of the name "steady" gets a number, since names must be unique.
  EXPECT_EQ(plan->stages[2].name, "steady2");
  EXPECT_EQ(plan->requirements, std::vector<std::string>{"errors==0"});
  // The stages last 1 s, 2 s and 2 s.
  EXPECT_DOUBLE_EQ(plan->duration_s(), 5);
  EXPECT_EQ(plan->stage_begin_ns(2), 3'000'000'000);
  const auto again = parse_plan(to_json_text(*plan));
  ASSERT_TRUE(again) << again.error();
  EXPECT_EQ(to_json_text(*again), to_json_text(*plan));
  // The report of a run contains its plan, with which the run can be repeated.
  const auto from_report = parse_plan("{\"run\": {}, \"plan\": " + to_json_text(*plan) + "}");
  ASSERT_TRUE(from_report) << from_report.error();
  EXPECT_EQ(to_json_text(*from_report), to_json_text(*plan));
}

TEST(Plan, refuses_bad_json_and_names_the_key) {
  const std::vector<std::pair<const char*, const char*>> bad{
      {"{", "not JSON"},
      {"[]", "not a JSON object"},
      {R"({"plan": 3})", "plan"},
      {R"({"stages": []})", "needs a stage"},
      {R"({"stages": "steady:1s"})", "stages: is not a list"},
      {R"({"stages": [1]})", "stages: is not a list"},
      {R"({"stages": ["steady"]})", "stages: stage 'steady'"},
      {R"({"seed": -1, "stages": ["steady:1s"]})", "seed"},
      {R"({"pose_hz": "x", "stages": ["steady:1s"]})", "pose_hz"},
      {R"({"pose_hz": 0, "stages": ["steady:1s"]})", "pose_hz"},
      {R"({"grooms": [], "stages": ["steady:1s"]})", "needs a groom"},
      {R"({"observe": "some", "stages": ["steady:1s"]})", "observe"},
      {R"({"touch_share": 2, "stages": ["steady:1s"]})", "touch_share is not in 0 to 1"},
      {R"({"props_share": -1, "stages": ["steady:1s"]})", "props_share is not in 0 to 1"},
      {R"({"props_share": "x", "stages": ["steady:1s"]})", "props_share: is not a number"},
      {R"({"hair_error_mm": "x", "stages": ["steady:1s"]})", "hair_error_mm: is not a number"},
      {R"({"frame_bytes_per_s": "x", "stages": ["steady:1s"]})", "frame_bytes_per_s: is not a number"},
      {R"({"room_size": -2, "stages": ["steady:1s"]})", "room_size"},
      {R"({"stages": ["steady:1s"], "require": ["errors"]})", "requirement 'errors'"},
      {R"({"stages": ["steady:1s:attack=big", "steady:1s"]})", "a stage with an attack needs"},
      {R"({"stages": ["steady:1s", "steady:1s:attack=big", "steady:1s:attack=wind", "steady:1s"]})",
       "a stage with an attack needs"},
      {R"({"stage": ["steady:1s"]})", "stage: unknown key"}};
  for (const auto& [json, error] : bad) {
    const auto plan = parse_plan(json);
    ASSERT_FALSE(plan) << json;
    EXPECT_THAT(plan.error(), HasSubstr(error)) << json;
  }
}

TEST(Plan, presets_are_valid) {
  for (const Preset& preset : presets()) EXPECT_TRUE(preset_plan(preset.name)) << preset.name;
  EXPECT_FALSE(preset_plan("nothing"));
}

// An attack that is missing in the preset would never be tried.
TEST(Plan, hostile_preset_has_every_attack_once_and_measures_attacks_alone) {
  const auto plan = preset_plan("hostile");
  ASSERT_TRUE(plan) << plan.error();
  std::vector<std::string> attacks;
  for (const Stage& stage : plan->stages) {
    EXPECT_EQ(stage.measured, stage.attack.has_value()) << stage.name;
    if (!stage.attack) continue;
    attacks.emplace_back(kAttackNames[static_cast<std::size_t>(*stage.attack)]);
    EXPECT_EQ(stage.name, attacks.back());
  }
  EXPECT_TRUE(std::ranges::equal(attacks, kAttackNames));
  EXPECT_FALSE(plan->requirements.empty());
}

}  // namespace
}  // namespace hairnet::load
