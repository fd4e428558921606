// The layers of depth that the screen is known in: what the camera sees, and what lies behind that, LAYER 2 and on. Names of a
// layer's textures, and what a pass that draws one needs of the layer in front of it.
//
// C. Everitt, "Interactive Order-Independent Transparency", NVIDIA 2001: the nearest of what is farther than the layer before.

#if LAYER == 2
#define PLANES ssdo_planes_2
#define PLANES_BEFORE ssdo_planes
#define SENT_LIGHT ssdo_layer2_sent
#elif LAYER == 3
#define PLANES ssdo_planes_3
#define PLANES_BEFORE ssdo_planes_2
#define SENT_LIGHT ssdo_layer3_sent
#elif LAYER == 4
#define PLANES ssdo_planes_4
#define PLANES_BEFORE ssdo_planes_3
#define SENT_LIGHT ssdo_layer4_sent
#else
#define PLANES ssdo_planes
#define SENT_LIGHT ssdo_sent
#endif

// A depth this many times that of the layer before lies behind it: 80 units in the last place of a 32-bit float, by which two
// programs that draw one surface do not differ.
const float BEHIND = 1.00001;
