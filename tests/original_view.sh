#!/usr/bin/env bash
# A picture of a map by the raster original (ioquake3), to hold beside ours, without a display.
#   original_view.sh MAP "X Y Z YAW" OUT.png [lit|fullbright|texels] [WxH]
# `fullbright` shows textures without light, `texels` those unfiltered, so that nothing is averaged on encoded values.
# Needs (Debian): openarena and its data, ioquake3, xvfb, imagemagick.
# X Y Z is the player's origin. `setviewpos` lifts it a unit and throws it forward at 400 units/s, which friction brakes:
# with `pmove_fixed` it always comes to rest at the same place, THROWN units on (see albedo_original.py).
# The renderer is opengl1: ioquake3's default, opengl2, tone-maps every picture by an exposure of its own.
set -u
map=$1 pos=$2 out=$3 mode=${4:-lit} size=${5:-640x360}
width=${size%x*} height=${size#*x}
home=$(mktemp -d) display=:$((90 + RANDOM % 400))
trap 'kill "$server" 2>/dev/null; rm -rf "$home"' EXIT
mkdir -p "$home/.openarena/baseoa"
cat > "$home/.openarena/baseoa/view.cfg" <<C
set cg_draw2D 0
set cg_drawGun 0
set cg_fov 90
set cg_thirdPerson 0
set con_notifytime -1
set r_screenshotJpegQuality 100
wait 60
noclip
wait 5
setviewpos $pos
wait 60
screenshotJPEG view
wait 5
quit
C
Xvfb $display -screen 0 "${width}x${height}x24" >/dev/null 2>&1 & server=$!
sleep 1
fullbright=1 filter=GL_LINEAR_MIPMAP_LINEAR
[[ $mode == lit ]] && fullbright=0
[[ $mode == texels ]] && filter=GL_NEAREST
DISPLAY=$display HOME=$home timeout 120 /usr/games/openarena \
  +set cl_renderer opengl1 +set r_mode -1 +set r_customwidth "$width" +set r_customheight "$height" +set r_fullscreen 0 \
  +set r_ignorehwgamma 1 +set r_gamma 1 +set r_intensity 1 +set r_picmip 0 +set r_texturebits 32 +set r_ext_compressed_textures 0 \
  +set r_textureMode $filter +set r_subdivisions 1 +set r_lodCurveError 10000 +set r_fullbright $fullbright \
  +set com_maxfps 30 +set pmove_fixed 1 +set pmove_msec 8 +set s_initsound 0 +set g_doWarmup 0 +set sv_pure 0 +set bot_enable 0 \
  +devmap "$map" +exec view.cfg > "$home/log" 2>&1 < /dev/null
shot=$(find "$home" -name 'view*' -path '*screenshots*' | head -n 1)
[[ -n $shot ]] || { tail -n 5 "$home/log" >&2; exit 1; }
convert "$shot" "$out" && echo "$out"
