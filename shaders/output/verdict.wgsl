// A verdict on an instance: bit 1 says kept, bit 0 tells the two kinds apart.
const OUTSIDE: u32 = 0u;
const OCCLUDED: u32 = 1u;
const VISIBLE: u32 = 2u;
const INVALID: u32 = 3u;
