/** How a character's hair is computed, the finest first (`hairnet_level` of client/hairnet.h). */
export enum LevelIndex {
  high,
  medium,
  low,
  ether,
  learnt,
  rigid,
}
