#include "server/tick/budget.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "tests/support/own_allocator.hpp"

namespace hairnet::server {
namespace {

using own_allocator::allocation_count;

constexpr double kTick_s = 1.0 / 30;

// The finest level that a character may have.
LevelIndex finest(const BudgetCharacter& c) {
  if (!c.levels_ready || c.requested_level == LevelIndex::rigid) return LevelIndex::rigid;
  if (c.may_learn) return c.requested_level < LevelIndex::low ? c.requested_level : LevelIndex::learnt;
  return c.requested_level == LevelIndex::learnt ? LevelIndex::low : c.requested_level;
}

// A server that applies the chosen levels, tick by tick.
struct Play {
  CostEstimate cost{kTick_s};
  BudgetTerms terms;
  std::vector<BudgetCharacter> characters;
  std::vector<Lod> chosen;
  BudgetScratch scratch;
  BudgetReport report;

  explicit Play(double available_s) {
    terms.available_s = available_s;
    terms.encode_s = {3e-6, 2e-6, 1e-6, 1e-6, 1e-6, 0.3e-6};
    terms.send_s = 0.1e-6;
  }

  BudgetCharacter& add(std::uint32_t subject, std::uint64_t session, float importance = 0.3f) {
    BudgetCharacter c;
    c.key = characters.size() + 1;
    c.subject = subject;
    c.session = session;
    c.importance = importance;
    c.observer_count = 4;
    c.levels_ready = true;
    return characters.emplace_back(c);
  }

  // Choices that changed.
  std::size_t tick() {
    terms.cost = &cost;
    chosen.resize(characters.size());
    report = choose_levels(terms, characters, scratch, chosen);
    std::size_t changes = 0;
    for (std::size_t i = 0; i < characters.size(); ++i) {
      BudgetCharacter& c = characters[i];
      c.since_s = c.now == chosen[i] ? c.since_s + kTick_s : 0;
      changes += c.now != chosen[i];
      c.now = chosen[i];
    }
    return changes;
  }

  // The cost as the header defines it, computed independently.
  [[nodiscard]] double cost_s(const BudgetCharacter& c, const Lod& lod) const {
    const bool has_hair_to_show = lod.level == LevelIndex::rigid && finest(c) != LevelIndex::rigid;
    if (lod.suspended || (c.asleep && lod == c.now && !has_hair_to_show)) return 0;
    return (cost.turn_s(lod.level, lod.stride) + terms.encode_s[static_cast<std::size_t>(lod.level)] +
            c.observer_count * terms.send_s) /
           lod.stride;
  }
  [[nodiscard]] double sum_s() const {
    double sum = 0;
    for (std::size_t i = 0; i < characters.size(); ++i) sum += cost_s(characters[i], chosen[i]);
    return sum;
  }
  [[nodiscard]] double error(std::size_t i) const { return expected_error(chosen[i].level, chosen[i].stride); }
};

struct Dice {
  std::mt19937 random;
  double uniform(double low, double high) { return std::uniform_real_distribution<>(low, high)(random); }
  std::uint32_t below(std::uint32_t count) { return static_cast<std::uint32_t>(random() % count); }
};

Play random_play(unsigned seed, bool with_odd_ones = true) {
  Dice dice{std::mt19937(seed)};
  Play play(std::pow(10, dice.uniform(-4.5, -1.5)));
  const std::uint32_t count = 1 + dice.below(300), subjects = 1 + dice.below(8), sessions = 1 + dice.below(100);
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t session = dice.below(sessions);
    BudgetCharacter& c =
        play.add(session % subjects, session, static_cast<float>(std::pow(10, dice.uniform(-2.5, 0.2))));
    c.observer_count = dice.below(20);
    c.head_speed_m_per_s = static_cast<float>(dice.uniform(0, 2));
    c.requested_level = static_cast<LevelIndex>(dice.below(kLevelCount));
    c.may_learn = dice.below(3) == 0;
    if (!with_odd_ones) continue;
    c.levels_ready = dice.below(10) != 0;
    c.asleep = dice.below(5) == 0;
    if (dice.below(6) == 0) c.unseen_s = static_cast<float>(dice.uniform(0, 2));
    c.now = {static_cast<LevelIndex>(dice.below(kLevelCount)), static_cast<std::uint8_t>(1 << dice.below(3)),
             dice.below(8) == 0};
    c.since_s = dice.uniform(0, 2);
  }
  return play;
}

TEST(Budget, is_kept_whenever_the_least_of_everyone_fits) {
  int kept = 0;
  for (unsigned seed = 0; seed < 300; ++seed) {
    Play play = random_play(seed);
    std::vector<BudgetCharacter> before = play.characters;
    play.tick();
    std::swap(play.characters, before);  // sleepers are recognised by their last levels
    const double rounding_s = 1e-9 * static_cast<double>(before.size());
    EXPECT_NEAR(play.sum_s(), play.report.predicted_s, rounding_s) << "seed " << seed;
    if (!play.report.is_over) {
      EXPECT_LE(play.sum_s(), play.terms.available_s + rounding_s) << "seed " << seed;
      ++kept;
      continue;
    }
    for (std::size_t i = 0; i < before.size(); ++i) {
      const bool is_least = play.chosen[i] == Lod{LevelIndex::rigid, 4, false};
      EXPECT_TRUE(is_least || play.cost_s(play.characters[i], play.chosen[i]) == 0) << "seed " << seed;
    }
  }
  EXPECT_GT(kept, 100);
}

TEST(Budget, gives_only_what_was_asked_for_and_is_ready) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    Play play = random_play(seed);
    play.terms.available_s *= 100;
    play.tick();
    for (std::size_t i = 0; i < play.characters.size(); ++i) {
      const BudgetCharacter& c = play.characters[i];
      EXPECT_EQ(play.chosen[i].suspended, c.unseen_s >= kSuspendAfter_s);
      if (play.chosen[i].suspended) continue;
      // Who asks for learnt hair may get low.
      EXPECT_GE(play.chosen[i].level, c.requested_level == LevelIndex::learnt ? LevelIndex::low : c.requested_level);
      if (!c.levels_ready) {
        EXPECT_EQ(play.chosen[i].level, LevelIndex::rigid);
      }
    }
  }
}

TEST(Budget, gives_everyone_what_was_asked_for_when_there_is_room) {
  Play play = random_play(5, false);
  play.terms.available_s = 10;
  play.tick();
  for (std::size_t i = 0; i < play.characters.size(); ++i) {
    EXPECT_EQ(play.chosen[i], (Lod{finest(play.characters[i]), 1, false}));
  }
  EXPECT_EQ(play.report.below_wanted, 0u);
  EXPECT_NEAR(play.report.wanted_s, play.report.predicted_s, 1e-12);
}

TEST(Budget, puts_nearly_all_of_a_crowd_on_the_learnt_level_where_low_would_not_fit) {
  Play play(5e-3);
  for (int i = 0; i < 2000; ++i) play.add(0, 7).may_learn = true;
  for (int tick = 0; tick < 60; ++tick) play.tick();
  EXPECT_FALSE(play.report.is_over);
  const auto learnt = std::ranges::count(play.chosen, LevelIndex::learnt, &Lod::level);
  EXPECT_GT(learnt, 1900);
  for (const Lod& lod : play.chosen) EXPECT_LE(lod.level, LevelIndex::learnt);  // or finer
}

TEST(Budget, leaves_the_learnt_level_as_soon_as_it_does_not_hold) {
  Play play(10);
  play.add(0, 7).may_learn = true;
  play.characters[0].requested_level = LevelIndex::low;
  play.tick();
  EXPECT_EQ(play.chosen[0], (Lod{LevelIndex::learnt, 1, false}));
  play.characters[0].may_learn = false;
  play.characters[0].asleep = true;
  play.tick();
  for (int tick = 0; tick < 30; ++tick) play.tick();
  EXPECT_EQ(play.chosen[0], (Lod{LevelIndex::low, 1, false}));
}

TEST(Budget, spreads_low_levels_evenly_before_it_favours_anyone) {
  Dice dice{std::mt19937(4)};
  int uneven = 0;
  for (double available_s = 20e-6; available_s < 20e-3; available_s *= 1.1) {
    Play play(available_s);
    for (int i = 0; i < 80; ++i) play.add(0, 7, static_cast<float>(std::pow(10, dice.uniform(-2.5, 0))));
    play.tick();
    const double even = expected_error(LevelIndex::low, 4);
    std::set<std::pair<LevelIndex, int>> below;
    bool is_anyone_favoured = false;
    for (std::size_t i = 0; i < play.characters.size(); ++i) {
      if (play.error(i) > even) below.insert({play.chosen[i].level, play.chosen[i].stride});
      is_anyone_favoured |= play.error(i) < even;
    }
    EXPECT_TRUE(below.empty() || !is_anyone_favoured) << available_s;
    EXPECT_LE(below.size(), 2u) << available_s;
    uneven += is_anyone_favoured;
  }
  EXPECT_GT(uneven, 5);
}

TEST(Budget, gives_the_more_important_of_two_no_less) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    Dice dice{std::mt19937(seed)};
    Play play(std::pow(10, dice.uniform(-4, -2)));
    for (int i = 0; i < 60; ++i) play.add(0, 7, static_cast<float>(std::pow(10, dice.uniform(-2, 0))));
    play.tick();
    std::vector<std::size_t> by_importance(play.characters.size());
    for (std::size_t i = 0; i < by_importance.size(); ++i) by_importance[i] = i;
    std::ranges::sort(by_importance, std::greater{}, [&](std::size_t i) { return play.characters[i].importance; });
    for (std::size_t k = 1; k < by_importance.size(); ++k) {
      EXPECT_LE(play.error(by_importance[k - 1]), play.error(by_importance[k])) << "seed " << seed;
    }
  }
}

TEST(Budget, gives_a_character_no_less_when_it_becomes_more_important) {
  for (unsigned seed = 0; seed < 300; ++seed) {
    Play play = random_play(seed, false);
    Play raised = play;
    const std::size_t who = seed % play.characters.size();
    raised.characters[who].importance *= 3;
    play.tick();
    raised.tick();
    EXPECT_LE(raised.error(who), play.error(who)) << "seed " << seed;
  }
}

TEST(Budget, gives_touched_hair_what_it_gives_a_head_that_fills_the_screen) {
  int others = 0;
  for (unsigned seed = 0; seed < 50; ++seed) {
    Play untouched = random_play(seed, false);
    untouched.characters[0].importance = 0.02f;
    Play touched = untouched, large = untouched;
    touched.characters[0].is_touched = true;
    large.characters[0].importance = 1;
    for (Play* play : {&untouched, &touched, &large}) play->tick();
    EXPECT_EQ(touched.chosen, large.chosen);
    others += touched.chosen[0] != untouched.chosen[0] ? 1 : 0;
  }
  EXPECT_GT(others, 5);
}

TEST(Budget, does_not_depend_on_the_order_of_characters) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    Play play = random_play(seed);
    Play shuffled = play;
    std::shuffle(shuffled.characters.begin(), shuffled.characters.end(), std::mt19937(seed));
    for (int tick = 0; tick < 5; ++tick) {
      play.tick();
      shuffled.tick();
      std::map<std::uint64_t, Lod> by_key;
      for (const BudgetCharacter& c : play.characters) by_key[c.key] = c.now;
      for (const BudgetCharacter& c : shuffled.characters) ASSERT_EQ(c.now, by_key[c.key]) << "seed " << seed;
    }
  }
}

TEST(Budget, changes_nothing_while_nothing_changes) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    Play play = random_play(seed);
    for (BudgetCharacter& c : play.characters) c.unseen_s = c.unseen_s > 0 ? 5 : 0;
    for (int tick = 0; tick < 90; ++tick) play.tick();
    for (int tick = 0; tick < 100; ++tick) ASSERT_EQ(play.tick(), 0u) << "seed " << seed << ", tick " << tick;
  }
}

// The noise's extremes may come late, so one last change is allowed; changes back and forth are not.
TEST(Budget, does_not_flicker_when_costs_and_importance_are_noisy) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    Play play = random_play(seed, false);
    Dice dice{std::mt19937(seed + 1000)};
    const std::vector<BudgetCharacter> steady = play.characters;
    const double available_s = play.terms.available_s;
    std::map<std::uint64_t, int> changes;
    for (int tick = 0; tick < 30 * 30; ++tick) {
      play.terms.available_s = available_s * dice.uniform(0.97, 1.03);
      for (std::size_t i = 0; i < steady.size(); ++i) {
        play.characters[i].importance = steady[i].importance * static_cast<float>(dice.uniform(0.97, 1.03));
      }
      play.tick();
      if (tick < 30 * 10) continue;
      for (const BudgetCharacter& c : play.characters) changes[c.key] += c.since_s == 0;
    }
    int changed = 0;
    for (const auto& [key, count] : changes) {
      EXPECT_LE(count, 1) << "seed " << seed << ", character " << key;
      changed += count;
    }
    EXPECT_LE(changed, 2) << "seed " << seed << " of " << steady.size();
  }
}

TEST(Budget, lowers_at_once_and_gives_back_within_two_seconds) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    Play play = random_play(seed, false);
    play.terms.available_s = 1;
    for (int tick = 0; tick < 60; ++tick) play.tick();
    const std::vector<Lod> best = play.chosen;
    EXPECT_EQ(play.report.below_wanted, 0u);
    play.terms.available_s = 0.3 * play.report.predicted_s;
    play.tick();
    EXPECT_LE(play.report.predicted_s, play.terms.available_s);
    for (int tick = 0; tick < 100; ++tick) play.tick();
    play.terms.available_s = 1;
    for (int tick = 0; tick < 60; ++tick) play.tick();
    EXPECT_EQ(play.chosen, best) << "seed " << seed;
  }
}

TEST(Budget, a_subject_of_many_clients_takes_nothing_from_another_subjects_share) {
  Play play(3e-3);
  for (std::uint64_t i = 0; i < 4; ++i) play.add(1, 100 + i, 0.1f);
  for (int tick = 0; tick < 60; ++tick) play.tick();
  const std::vector<Lod> alone = play.chosen;
  EXPECT_EQ(alone[0].level, LevelIndex::high);
  for (std::uint64_t i = 0; i < 500; ++i) play.add(2, 1000 + i, 1.0f);
  for (int tick = 0; tick < 90; ++tick) play.tick();
  EXPECT_LE(play.report.predicted_s, play.terms.available_s);
  EXPECT_TRUE(std::equal(alone.begin(), alone.end(), play.chosen.begin()));
}

TEST(Budget, a_client_of_many_takes_nothing_from_another_clients_share) {
  Play play(2e-3);
  play.add(1, 100, 0.1f);
  for (int i = 0; i < 300; ++i) play.add(1, 101, 1.0f);
  for (int tick = 0; tick < 90; ++tick) play.tick();
  EXPECT_EQ(play.chosen[0], (Lod{LevelIndex::high, 1, false}));
  EXPECT_GT(play.report.below_wanted, 100u);
}

// Eight people of one room and forty people in rooms of their own: rooms have no share.
TEST(Budget, forty_subjects_leave_eight_their_equal_shares) {
  constexpr double kAvailable_s = 4e-3;
  Play alone(kAvailable_s / 48);
  alone.add(1, 1, 0.1f);
  for (int tick = 0; tick < 90; ++tick) alone.tick();
  Play play(kAvailable_s);
  for (std::uint32_t i = 0; i < 8; ++i) play.add(1 + i, 100 + i, 0.1f);
  for (std::uint32_t i = 0; i < 40; ++i) {
    for (int character = 0; character < 20; ++character) play.add(50 + i, 1000 + i, 1.0f);
  }
  for (int tick = 0; tick < 90; ++tick) play.tick();
  EXPECT_LT(alone.error(0), 1) << "the share buys something";
  for (std::size_t i = 0; i < 8; ++i) EXPECT_LE(play.error(i), alone.error(0)) << i;
  EXPECT_GT(play.report.below_wanted, 100u);
}

TEST(Budget, a_subject_gains_nothing_by_more_sessions) {
  Play one(1e-3), many(1e-3);
  for (Play* play : {&one, &many}) {
    for (std::uint64_t i = 0; i < 4; ++i) play->add(1 + static_cast<std::uint32_t>(i), 100 + i, 0.1f);
    for (std::uint64_t i = 0; i < 40; ++i) play->add(9, play == &one ? 900 : 900 + i, 1.0f);
    for (int tick = 0; tick < 90; ++tick) play->tick();
  }
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(one.chosen[i].level, LevelIndex::high);
    EXPECT_EQ(many.chosen[i].level, LevelIndex::high);
  }
}

// Shares that were full before the new client came are cut for it.
TEST(Budget, makes_room_for_a_late_joiner) {
  Play play(1e-3);
  for (std::uint64_t i = 0; i < 11; ++i) play.add(1, i);
  for (int tick = 0; tick < 90; ++tick) play.tick();
  for (std::uint64_t i = 20; i < 23; ++i) play.add(2, i);
  for (int tick = 0; tick < 90; ++tick) play.tick();
  for (std::size_t i = 11; i < 14; ++i) EXPECT_EQ(play.chosen[i].level, LevelIndex::high);
}

// Rung 0 of all takes more than 80 % of the budget, and what everybody has more than 95 %.
TEST(Budget, makes_room_for_late_joiners_where_sending_takes_most_of_it) {
  constexpr std::size_t kMany = 24, kNew = 3;
  Play play(1);
  play.terms.send_s = 30e-6;
  for (std::size_t i = 0; i < kMany; ++i) play.add(1, 100, 1.0f).requested_level = LevelIndex::low;
  const double low_s = play.cost_s(play.characters[0], {LevelIndex::low, 4, false});
  const double rigid_s = play.cost_s(play.characters[0], {LevelIndex::rigid, 4, false});
  play.terms.available_s = (kMany * low_s + kNew * rigid_s) / 0.985;
  for (int tick = 0; tick < 60; ++tick) play.tick();
  EXPECT_EQ(play.chosen[0], (Lod{LevelIndex::low, 4, false}));
  for (std::size_t i = 0; i < kNew; ++i) play.add(2, 200, 0.1f).requested_level = LevelIndex::low;
  for (int tick = 0; tick < 90; ++tick) play.tick();
  for (std::size_t i = 0; i < kNew; ++i) EXPECT_LT(play.error(kMany + i), 1) << i;
  EXPECT_LE(play.report.predicted_s, play.terms.available_s);
  for (int tick = 0; tick < 200; ++tick) EXPECT_EQ(play.tick(), 0u);
}

TEST(Budget, lets_sleepers_lie_and_wakes_none) {
  Play play(1e-3);
  for (int i = 0; i < 50; ++i) {
    BudgetCharacter& c = play.add(0, 1);
    c.asleep = true;
    c.now = {LevelIndex::low, 2, false};
  }
  EXPECT_EQ(play.tick(), 0u);
  EXPECT_EQ(play.report.predicted_s, 0);
  play.characters[0].asleep = false;
  play.tick();
  for (int tick = 0; tick < 30; ++tick) play.tick();
  EXPECT_EQ(play.chosen[0].level, LevelIndex::high);
  EXPECT_EQ(play.chosen[1], (Lod{LevelIndex::low, 2, false}));
}

TEST(Budget, a_suspended_character_is_resumed_as_soon_as_it_is_seen) {
  Play play(1);
  play.add(0, 1);
  play.tick();
  play.characters[0].unseen_s = 0.9f;
  EXPECT_EQ(play.tick(), 0u);
  play.characters[0].unseen_s = 1;
  play.tick();
  EXPECT_TRUE(play.chosen[0].suspended);
  play.characters[0].unseen_s = 0;
  play.tick();
  EXPECT_EQ(play.chosen[0], (Lod{LevelIndex::high, 1, false}));
}

TEST(Budget, survives_nonsense) {
  Play play(1e-3);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (int i = 0; i < 20; ++i) {
    BudgetCharacter& c = play.add(0, 1);
    c.importance = i % 2 ? nan : -1;
    c.head_speed_m_per_s = i % 3 ? nan : 1e30f;
    c.observer_count = i % 5 ? 4 : 0xffffffffu;
  }
  for (const double available_s : {1e-3, 0.0, -1.0, 1e300, std::numeric_limits<double>::quiet_NaN()}) {
    play.terms.available_s = available_s;
    play.tick();
    for (const Lod& lod : play.chosen) EXPECT_FALSE(lod.suspended);
    EXPECT_TRUE(std::isfinite(play.report.predicted_s));
  }
}

TEST(Budget, allocates_nothing_once_it_has_warmed_up) {
  Play play(20e-3);
  for (std::uint64_t i = 0; i < 2000; ++i) play.add(static_cast<std::uint32_t>(i % 20), i % 300);
  play.tick();
  play.terms.available_s = 5e-3;
  play.tick();
  for (int tick = 0; tick < 30; ++tick) play.tick();
  const std::size_t before = allocation_count;
  play.terms.available_s = 20e-3;
  for (int tick = 0; tick < 30; ++tick) play.tick();
  play.terms.available_s = 4e-3;
  for (int tick = 0; tick < 30; ++tick) play.tick();
  EXPECT_EQ(allocation_count, before);
}

}  // namespace
}  // namespace hairnet::server
