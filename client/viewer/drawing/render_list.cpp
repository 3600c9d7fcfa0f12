#include "client/viewer/drawing/render_list.hpp"

namespace hairnet::viewer {

std::size_t StageCast::number_of(const std::shared_ptr<const Groom>& groom) {
  const auto [place, is_new] = grooms_.try_emplace(groom.get());
  if (is_new) place->second = {groom, stage_.add_groom(*groom), true};
  place->second.worn = true;
  return place->second.number;
}

std::span<const view::ShownCharacter> StageCast::show(std::span<const Subject> subjects) {
  for (auto& [key, groom] : grooms_) groom.worn = false;
  shown_.clear();
  for (const Subject& subject : subjects) {
    view::ShownCharacter shown;
    shown.groom = number_of(subject.groom);
    shown.pose = subject.pose;
    shown.layers = subject.layers;
    shown.hair_colour = colour_ != nullptr ? colour_(subject) : subject.hair_colour;
    shown_.push_back(shown);
  }
  std::erase_if(grooms_, [this](const auto& entry) {
    if (!entry.second.worn) stage_.remove_groom(entry.second.number);
    return !entry.second.worn;
  });
  return shown_;
}

}  // namespace hairnet::viewer
