//! `surfaceparm`: what a surface and the volume behind it do in the game and in the map compiler.

/// Surface flag bits of a BSP's shader lump (id's `surfaceflags.h`).
pub mod surface {
    pub const NO_DAMAGE: u32 = 0x1;
    pub const SLICK: u32 = 0x2;
    pub const SKY: u32 = 0x4;
    pub const LADDER: u32 = 0x8;
    pub const NO_IMPACT: u32 = 0x10;
    pub const NO_MARKS: u32 = 0x20;
    pub const FLESH: u32 = 0x40;
    pub const NO_DRAW: u32 = 0x80;
    pub const HINT: u32 = 0x100;
    pub const SKIP: u32 = 0x200;
    pub const NO_LIGHTMAP: u32 = 0x400;
    pub const POINT_LIGHT: u32 = 0x800;
    pub const METAL_STEPS: u32 = 0x1000;
    pub const NO_STEPS: u32 = 0x2000;
    pub const NON_SOLID: u32 = 0x4000;
    pub const LIGHT_FILTER: u32 = 0x8000;
    pub const ALPHA_SHADOW: u32 = 0x10000;
    pub const NO_DLIGHT: u32 = 0x20000;
    pub const DUST: u32 = 0x40000;
}

/// Content flag bits of a BSP's shader lump (id's `surfaceflags.h`).
pub mod content {
    pub const SOLID: u32 = 0x1;
    pub const LAVA: u32 = 0x8;
    pub const SLIME: u32 = 0x10;
    pub const WATER: u32 = 0x20;
    pub const FOG: u32 = 0x40;
    pub const AREA_PORTAL: u32 = 0x8000;
    pub const PLAYER_CLIP: u32 = 0x1_0000;
    pub const MONSTER_CLIP: u32 = 0x2_0000;
    pub const CLUSTER_PORTAL: u32 = 0x10_0000;
    pub const DO_NOT_ENTER: u32 = 0x20_0000;
    pub const BOT_CLIP: u32 = 0x40_0000;
    pub const ORIGIN: u32 = 0x100_0000;
    pub const DETAIL: u32 = 0x800_0000;
    pub const STRUCTURAL: u32 = 0x1000_0000;
    pub const TRANSLUCENT: u32 = 0x2000_0000;
    pub const TRIGGER: u32 = 0x4000_0000;
    pub const NO_DROP: u32 = 0x8000_0000;
}

macro_rules! surface_parms {
    ($($variant:ident $name:literal $surface:expr, $content:expr, $solid:ident;)*) => {
        /// A `surfaceparm` known to q3map2's Quake III profile.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum SurfaceParm {
            $(#[doc = concat!("`", $name, "`")] $variant,)*
        }

        impl SurfaceParm {
            /// Every parameter.
            pub const ALL: &[Self] = &[$(Self::$variant),*];

            /// Its name in scripts.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }

            /// Bits it sets in a BSP's surface flags.
            pub fn surface_flags(self) -> u32 {
                match self { $(Self::$variant => $surface,)* }
            }

            /// Bits it sets in a BSP's content flags.
            pub fn content_flags(self) -> u32 {
                match self { $(Self::$variant => $content,)* }
            }

            /// Whether it makes the volume behind the surface not solid.
            pub fn clears_solid(self) -> bool {
                match self { $(Self::$variant => surface_parms!(@ $solid),)* }
            }
        }
    };
    (@ keep) => { false };
    (@ clear) => { true };
}

// q3map2 gives both kinds of vertex lighting the same two bits.
const VERTEX_LIT: u32 = surface::NO_LIGHTMAP | surface::POINT_LIGHT;

surface_parms! {
    LightGrid "lightgrid" 0, 0, keep;
    AntiPortal "antiportal" 0, 0, keep;
    Skip "skip" 0, 0, keep;
    Origin "origin" 0, content::ORIGIN, clear;
    AreaPortal "areaportal" 0, content::AREA_PORTAL, clear;
    Trans "trans" 0, content::TRANSLUCENT, keep;
    Detail "detail" 0, content::DETAIL, keep;
    Structural "structural" 0, content::STRUCTURAL, keep;
    Hint "hint" surface::HINT, 0, keep;
    NoDraw "nodraw" surface::NO_DRAW, 0, keep;
    AlphaShadow "alphashadow" surface::ALPHA_SHADOW, 0, keep;
    LightFilter "lightfilter" surface::LIGHT_FILTER, 0, keep;
    NoLightmap "nolightmap" VERTEX_LIT, 0, keep;
    PointLight "pointlight" VERTEX_LIT, 0, keep;
    NonSolid "nonsolid" surface::NON_SOLID, 0, clear;
    Trigger "trigger" 0, content::TRIGGER, clear;
    Water "water" 0, content::WATER, clear;
    Slime "slime" 0, content::SLIME, clear;
    Lava "lava" 0, content::LAVA, clear;
    PlayerClip "playerclip" 0, content::PLAYER_CLIP, clear;
    MonsterClip "monsterclip" 0, content::MONSTER_CLIP, clear;
    NoDrop "nodrop" 0, content::NO_DROP, clear;
    ClusterPortal "clusterportal" 0, content::CLUSTER_PORTAL, clear;
    DoNotEnter "donotenter" 0, content::DO_NOT_ENTER, clear;
    BotClip "botclip" 0, content::BOT_CLIP, clear;
    Fog "fog" 0, content::FOG, clear;
    Sky "sky" surface::SKY, 0, keep;
    Slick "slick" surface::SLICK, 0, keep;
    NoImpact "noimpact" surface::NO_IMPACT, 0, keep;
    NoMarks "nomarks" surface::NO_MARKS, 0, keep;
    Ladder "ladder" surface::LADDER, 0, keep;
    NoDamage "nodamage" surface::NO_DAMAGE, 0, keep;
    MetalSteps "metalsteps" surface::METAL_STEPS, 0, keep;
    Flesh "flesh" surface::FLESH, 0, keep;
    NoSteps "nosteps" surface::NO_STEPS, 0, keep;
    NoDLight "nodlight" surface::NO_DLIGHT, 0, keep;
    Dust "dust" surface::DUST, 0, keep;
}

impl SurfaceParm {
    /// By its name in scripts, in any case.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL
            .iter()
            .copied()
            .find(|parm| parm.name().eq_ignore_ascii_case(name))
    }
}

/// The `surfaceparm`s of a shader.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SurfaceParms {
    /// Each once, in the order of the script.
    pub known: Vec<SurfaceParm>,
    /// Names that q3map2 doesn't know (other games have more), as written.
    pub unknown: Vec<String>,
}

impl SurfaceParms {
    /// Whether `parm` is given.
    pub fn contains(&self, parm: SurfaceParm) -> bool {
        self.known.contains(&parm)
    }

    /// Adds `parm` unless it is there.
    pub fn insert(&mut self, parm: SurfaceParm) {
        if !self.contains(parm) {
            self.known.push(parm);
        }
    }

    /// Surface flags that q3map2 writes.
    pub fn surface_flags(&self) -> u32 {
        self.known.iter().fold(0, |flags, parm| flags | parm.surface_flags())
    }

    /// Content flags that q3map2 writes: solid unless a parameter clears it.
    pub fn content_flags(&self) -> u32 {
        let solid = if self.known.iter().any(|parm| parm.clears_solid()) {
            0
        } else {
            content::SOLID
        };
        self.known
            .iter()
            .fold(solid, |flags, parm| flags | parm.content_flags())
    }
}

#[cfg(test)]
mod tests {
    use super::{SurfaceParm, SurfaceParms, content, surface};

    #[test]
    fn names_lead_back_to_their_parameter() {
        for &parm in SurfaceParm::ALL {
            assert_eq!(SurfaceParm::from_name(&parm.name().to_uppercase()), Some(parm));
        }
        assert_eq!(SurfaceParm::from_name("nosuch"), None);
    }

    #[test]
    fn volumes_are_solid_unless_told_otherwise() {
        let mut parms = SurfaceParms::default();
        assert_eq!((parms.surface_flags(), parms.content_flags()), (0, content::SOLID));
        parms.insert(SurfaceParm::Trans);
        assert_eq!(parms.content_flags(), content::SOLID | content::TRANSLUCENT);
        parms.insert(SurfaceParm::Water);
        parms.insert(SurfaceParm::NoLightmap);
        assert_eq!(parms.content_flags(), content::WATER | content::TRANSLUCENT);
        assert_eq!(parms.surface_flags(), surface::NO_LIGHTMAP | surface::POINT_LIGHT);
    }
}
