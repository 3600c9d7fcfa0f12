#include "schema/wire/learnt_file.hpp"

#include <gtest/gtest.h>

#include "core/random.hpp"
#include "schema/wire/packing.hpp"
#include "tests/support/learnt.hpp"

namespace hairnet::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;

TEST(LearntFile, comes_back_the_same_without_what_it_knows_of_wind) {
  LearntHair hair = support::random_learnt_hair(3);
  hair.most[4] = 7;
  hair.error = 0.25f;
  hair.low_error = 0.5f;
  const Bytes bytes = encode_learnt(hair);
  const Result<LearntHair> got = decode_learnt(bytes);
  ASSERT_TRUE(got) << got.error();
  EXPECT_EQ(got->hidden_count, hair.hidden_count);
  EXPECT_EQ(got->mode_count, hair.mode_count);
  EXPECT_EQ(got->input_weights, hair.input_weights);
  EXPECT_EQ(got->hidden_weights, hair.hidden_weights);
  EXPECT_EQ(got->bias, hair.bias);
  EXPECT_EQ(got->output_weights, hair.output_weights);
  EXPECT_EQ(got->most, hair.most);
  EXPECT_EQ(got->error, hair.error);
  EXPECT_EQ(got->low_error, hair.low_error);
  // Clients evaluate learnt hair in still air alone, so the file leaves the weights for air out.
  EXPECT_TRUE(got->wind.weights.empty());
  EXPECT_EQ(encode_learnt(*got), bytes);
}

TEST(LearntFile, that_is_corrupted_is_refused_or_valid) {
  const Bytes bytes = encode_learnt(support::random_learnt_hair(3, 8, 4));
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_FALSE(decode_learnt(std::span(bytes).first(size))) << size;
  const Bytes table = unpack(bytes, kPackedLearnt).value();
  Random random(2);
  int accepted = 0, refused = 0;
  for (int round = 0; round < 5000; ++round) {
    Bytes corrupted = table;
    // The table is damaged without its compression, or nearly every damage would end in the decompression.
    for (std::uint64_t n = 0; n <= random.next() % 4; ++n)
      corrupted[random.next() % corrupted.size()] = static_cast<std::uint8_t>(random.next());
    const Result<LearntHair> got = decode_learnt(pack(corrupted, kPackedLearnt));
    (got ? accepted : refused) += 1;
    if (got)
      ASSERT_EQ(validate(*got), "");
    else
      ASSERT_NE(got.error(), "");
  }
  EXPECT_GT(accepted, 0);
  EXPECT_GT(refused, 0);
}

TEST(LearntFile, of_another_kind_is_refused) {
  const Bytes bytes = encode_learnt(support::random_learnt_hair(3)), table = unpack(bytes, kPackedLearnt).value();
  EXPECT_FALSE(decode_learnt(table));
  EXPECT_FALSE(decode_learnt(pack(table, kPackedBasis)));
  EXPECT_FALSE(decode_learnt({}));
}

}  // namespace
}  // namespace hairnet::wire
