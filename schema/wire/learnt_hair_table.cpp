#include "schema/wire/learnt_hair_table.hpp"

#include <algorithm>

#include "schema/wire/flatbuffer_convert.hpp"

namespace hairnet::wire {

flatbuffers::Offset<fb::LearntHair> write_learnt(flatbuffers::FlatBufferBuilder& to, const LearntHair& hair) {
  const auto input = to.CreateVector(hair.input_weights), hidden = to.CreateVector(hair.hidden_weights);
  const auto bias = to.CreateVector(hair.bias), output = to.CreateVector(hair.output_weights);
  const auto most = to.CreateVector(hair.most.data(), hair.most.size());
  return fb::CreateLearntHair(to, static_cast<std::uint32_t>(hair.hidden_count),
                              static_cast<std::uint32_t>(hair.mode_count), input, hidden, bias, output, most,
                              hair.error, hair.low_error);
}

flatbuffers::Offset<fb::LearntWind> write_wind(flatbuffers::FlatBufferBuilder& to, const LearntWind& wind) {
  return fb::CreateLearntWind(to, to.CreateVector(wind.weights), wind.max_m_per_s, wind.error, wind.low_error);
}

std::string read_learnt(const fb::LearntHair& in, const fb::LearntWind* wind, LearntHair& out) {
  out.hidden_count = in.hidden_count();
  out.mode_count = in.mode_count();
  from_flatbuffer(*in.input_weights(), out.input_weights);
  from_flatbuffer(*in.hidden_weights(), out.hidden_weights);
  from_flatbuffer(*in.bias(), out.bias);
  from_flatbuffer(*in.output_weights(), out.output_weights);
  // The array has a fixed size, and copying more would write beyond it. Other counts are compared by validate().
  if (in.most()->size() != out.most.size()) return "learnt hair with a wrong number of inputs";
  std::ranges::copy(*in.most(), out.most.begin());
  out.error = in.error();
  out.low_error = in.low_error();
  if (wind) {
    from_flatbuffer(*wind->weights(), out.wind.weights);
    out.wind.max_m_per_s = wind->max_m_per_s();
    out.wind.error = wind->error();
    out.wind.low_error = wind->low_error();
  }
  return validate(out);
}

}  // namespace hairnet::wire
