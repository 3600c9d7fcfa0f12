#include "client/assets/load_groom.hpp"

#include "client/assets/made_spec.hpp"
#include "client/files/read_file.hpp"
#include "core/hair_cards/far_cards.hpp"
#include "schema/wire/groom_file.hpp"

namespace hairnet {

Result<Groom> read_groom(const std::string& spec, const HairstyleOptions& made) {
  if (is_made_spec(spec)) return make_hairstyle(made_name(spec), made);
  const Result<std::vector<std::byte>> bytes = read_file(spec);
  if (!bytes) return Refusal(bytes.error());
  return wire::decode_groom({reinterpret_cast<const std::uint8_t*>(bytes->data()), bytes->size()});
}

Result<std::shared_ptr<const LearntHair>> load_learnt(const std::string& spec) {
  if (is_made_spec(spec)) return nullptr;
  const Result<std::vector<std::byte>> bytes = read_file(spec);
  if (!bytes) return Refusal(bytes.error());
  return wire::decode_learnt_of_groom({reinterpret_cast<const std::uint8_t*>(bytes->data()), bytes->size()});
}

Result<Groom> load_groom(const std::string& spec, const HairstyleOptions& made) {
  Result<Groom> groom = read_groom(spec, made);
  if (groom && groom->far_cards.cards.empty()) groom->far_cards = make_far_cards(*groom, far_card_count_for(*groom));
  return groom;
}

}  // namespace hairnet
