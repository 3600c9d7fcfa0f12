#include "client/viewer/sources/other_characters.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

#include "core/shown_text.hpp"
#include "schema/wire/groom_file.hpp"
#include "schema/wire/text.hpp"

namespace hairnet::viewer {

void OtherCharacters::take(const wire::MemberJoined& joined) {
  const auto found = members_.find(joined.member);
  if (found != members_.end()) {
    if (!found->second.moments.empty()) gone_.push_back(std::move(found->second));
    members_.erase(found);
  }
  members_[joined.member].joined = joined;
  want(joined.groom);
}

void OtherCharacters::take(const wire::MemberChanged& changed) {
  const auto found = members_.find(changed.member);
  if (found == members_.end()) return;
  found->second.joined.tag = changed.tag;
  found->second.joined.appearance = changed.appearance;
}

std::string OtherCharacters::Member::name() const {
  return wire::is_text(joined.tag) ? joined.tag : std::string();
}

std::string OtherCharacters::summary() const {
  std::string lines;
  for (const auto& [number, member] : members_) {
    if (!member.here) continue;
    const wire::MemberJoined& joined = member.joined;
    lines += "member " + std::to_string(number) + ": '" + shown_text(member.name(), wire::kTagBytesMax, '\'') +
             "', character " + std::to_string(joined.character) + " of session " + std::to_string(joined.session);
    if (joined.appearance) {
      const auto& [root, tip, skin, roughness] = *joined.appearance;
      std::array<char, 96> text{};
      std::snprintf(text.data(), text.size(),
                    ", hair #%02x%02x%02x to #%02x%02x%02x, skin #%02x%02x%02x, roughness %.2f", root.red, root.green,
                    root.blue, tip.red, tip.green, tip.blue, skin.red, skin.green, skin.blue, roughness / 255.0);
      lines += text.data();
    }
    lines += '\n';
  }
  return lines;
}

void OtherCharacters::want(const wire::GroomHash& groom) {
  if (grooms_.try_emplace(groom).second) link_.request_groom(groom);
}

void OtherCharacters::take(const wire::MemberLeft& left) {
  const auto found = members_.find(left.member);
  if (found == members_.end()) return;
  found->second.here = false;
  if (!found->second.moments.empty()) return;
  members_.erase(found);
  forget_unused_grooms();
}

void OtherCharacters::forget_unused_grooms() {
  std::erase_if(grooms_, [this](const auto& entry) {
    const auto wears = [&](const Member& member) { return member.joined.groom == entry.first; };
    const bool unused =
        entry.second &&
        std::none_of(members_.begin(), members_.end(), [&](const auto& numbered) { return wears(numbered.second); }) &&
        std::none_of(gone_.begin(), gone_.end(), wears);
    if (unused) retries_.erase(entry.first);
    return unused;
  });
}

std::shared_ptr<const Groom> OtherCharacters::groom_of(const Member& member) const {
  const auto found = grooms_.find(member.joined.groom);
  return found == grooms_.end() ? nullptr : found->second;
}

Result<void> OtherCharacters::take(const link::GroomFetched& fetched) {
  if (!fetched.bytes) return Refusal("another's groom: " + fetched.fault);
  Result<Groom> groom = wire::decode_groom(*fetched.bytes);
  if (!groom) return Refusal("another's groom: " + groom.error());
  grooms_[fetched.hash] = std::make_shared<const Groom>(std::move(*groom));
  return {};
}

bool OtherCharacters::retry(const wire::GroomHash& groom, std::int64_t now_ns) {
  const auto wanted = grooms_.find(groom);
  if (wanted == grooms_.end() || wanted->second) return false;
  retries_[groom] = now_ns + kRetry_ns;
  return true;
}

bool OtherCharacters::push(const link::Frame& frame, std::int64_t sample_time_ns, std::int64_t now_ns) {
  const auto found = members_.find(frame.member);
  if (found == members_.end()) return false;
  found->second.playout.push(frame, sample_time_ns, now_ns);
  return true;
}

void OtherCharacters::freeze() {
  for (auto& [number, member] : members_) member.playout.freeze();
}

void OtherCharacters::play(std::int64_t now_ns, std::ptrdiff_t moment) {
  for (auto& [number, member] : members_) {
    if (!member.here) continue;
    member.sample = member.playout.sample(now_ns);
    if (!member.sample.valid || moment < 0) continue;
    Moment shown(member.sample);
    shown.skin = link_.skin_of(member.joined.groom);
    member.moments.insert_or_assign(moment, std::move(shown));
  }
  std::erase_if(retries_, [&](const auto& retry) {
    if (now_ns < retry.second) return false;
    link_.request_groom(retry.first);
    return true;
  });
}

std::uint64_t OtherCharacters::name_of(std::uint32_t member) const {
  const wire::MemberJoined& joined = members_.at(member).joined;
  return joined.session << 32 | joined.character;
}

std::vector<SeenCharacter> OtherCharacters::seen(std::size_t moment_count) const {
  std::vector<SeenCharacter> seen;
  const auto add = [&](const Member& member) {
    const std::shared_ptr<const Groom>& groom = grooms_.at(member.joined.groom);
    if (!groom || member.moments.empty()) return;
    SeenCharacter& one = seen.emplace_back(SeenCharacter{groom, member.joined, {}});
    one.moments.resize(moment_count);
    for (const auto& [moment, shown] : member.moments) one.moments[static_cast<std::size_t>(moment)] = shown;
  };
  for (const Member& member : gone_) add(member);
  for (const auto& [number, member] : members_) add(member);
  return seen;
}

}  // namespace hairnet::viewer
