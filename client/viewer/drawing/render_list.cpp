#include "client/viewer/drawing/render_list.hpp"

#include "client/viewer/characters/hair_colour.hpp"

namespace hairnet::viewer {

void apply_appearance(const wire::Appearance& appearance, draw::ShownCharacter& shown) {
  shown.hair_colour = linear_of(appearance.hair_root);
  shown.hair_tip_colour = linear_of(appearance.hair_tip);
  shown.skin_colour = linear_of(appearance.skin);
  shown.roughness = static_cast<float>(appearance.roughness) / 255;
}

std::size_t RenderList::number_of(const ViewedCharacter& character) {
  const std::shared_ptr<const Groom>& groom = character.groom;
  const auto [place, is_new] = grooms_.try_emplace(groom.get());
  OnStage& on_stage = place->second;
  // The groom is kept, so that its address names it for as long as it is on the stage.
  if (is_new) on_stage = {groom, stage_.add_groom(*groom), true, nullptr};
  // A server's skin comes later than the groom, and is the same for all its characters.
  if (!on_stage.skin && character.skin) {
    on_stage.skin = character.skin;
    stage_.set_skin(on_stage.number, SkinPush(*character.skin, groom->materials.base.thickness_m));
  }
  on_stage.used = true;
  return on_stage.number;
}

std::span<const draw::ShownCharacter> RenderList::show(std::span<const ViewedCharacter> viewed) {
  // A groom that no character uses after this pass is freed below.
  for (auto& [key, groom] : grooms_) groom.used = false;
  shown_.clear();
  for (const ViewedCharacter& character : viewed) {
    draw::ShownCharacter shown;
    shown.id = character.id;
    shown.groom = number_of(character);
    shown.pose = character.pose;
    shown.lattice = character.lattice;
    shown.hair_colour = colour_ != nullptr ? colour_(character) : character.hair_colour;
    // The overlay of levels wins over a person's colours.
    if (character.appearance && colour_ == nullptr) apply_appearance(*character.appearance, shown);
    shown_.push_back(shown);
  }
  // Freed at once: a groom takes megabytes, and hair that comes back is uploaded again.
  std::erase_if(grooms_, [this](const auto& entry) {
    if (!entry.second.used) stage_.remove_groom(entry.second.number);
    return !entry.second.used;
  });
  return shown_;
}

}  // namespace hairnet::viewer
