// Which tiles of 8 x 8 pixels show something that light branches off at: a word each, behind the list of pixels of the secondary stage.
#ifndef SECONDARY_TILES_GLSL
#define SECONDARY_TILES_GLSL

uint tile_place(ivec2 tile) {
    return FC.size.x * FC.size.y + uint(tile.y) * ((FC.size.x + 7u) / 8u) + uint(tile.x);
}

// False outside the image.
bool tile_branches(ivec2 tile) {
    if (any(greaterThanEqual(tile, (ivec2(FC.size) + 7) / 8))) return false;
    return FC.secondary_pixels.at[tile_place(tile)] != 0;
}

#endif
