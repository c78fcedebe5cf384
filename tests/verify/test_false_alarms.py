"""Texts that were written rightly and once refused: each holds what made the verification object.

The numbers come from random programs, cut down to the moves that matter.
"""

from __future__ import annotations

import io
from dataclasses import dataclass, replace

import pytest

from cornersmooth.cl import read
from cornersmooth.kinematics import load_machine
from cornersmooth.model import Program
from cornersmooth.nc import choose_form
from cornersmooth.pipeline import postprocess
from cornersmooth.settings import Settings
from cornersmooth.verify import Verification, verify
from nc.cases import Case
from nc.promise import written
from oracle.share import share
from verify.random_programs import Trial
from verify.sweep import judged


@dataclass(frozen=True)
class Alarm:
    """A text that must pass.

    Parameters
    ----------
    case : Case
    tolerance, axis_length : float, mm
    cl : str
        Statements after those that every program begins with.
    inch : bool
    """

    case: Case
    tolerance: float
    axis_length: float
    cl: str
    inch: bool = False

    @property
    def program(self) -> Program:
        """The CL program."""
        units = "INCHES" if self.inch else "MM"
        feed = "" if "FEDRAT" in self.cl or "FEDTO" in self.cl else "FEDRAT/500,MMPM\n"
        return read(f"UNITS/{units}\nLOADTL/1\n{feed}RAPID\n{self.cl}FINI\n".encode(), name="part.cls")

    @property
    def text(self) -> str:
        """What is written for it."""
        settings = Settings(tolerance=self.tolerance, axis_length=self.axis_length)
        return written(self.program, self.case.choose(endless=True), settings)[0]

    def verified(self, text: str, *, slower: bool = False) -> Verification:
        """What is found in a text."""
        form = self.case.choose(endless=True)
        return verify(
            self.program,
            text.encode(),
            tolerance=self.tolerance,
            axis_length=self.axis_length,
            control=self.case.control,
            machine=form.machine,
            tcp=self.case.tcp,
            slower=slower,
            skip_cycles=True,
        )


#: without tip control, timed blocks in which the tip creeps by less than the digits of the linear axes show
CREEPING = Alarm(
    Case("fanuc", "g1", "head-ac", tcp=False),
    0.001,
    50.0,
    """GOTO/0.1211,-1.6194,-1.3692,-0.7642257,-0.0481552,0.6431487
FEDRAT/MMPM,27.7727
GOTO/0.1406,-1.6284,-1.3692,-0.6131925,0.0049931,0.7899178
GOTO/-58.3760,-5.7811,-1.3692,-0.6131925,0.0049931,0.7899178
""",
)

#: a dwell near the pole, where the first axis stays what it was: the pose is not quite where the CL file has it
DWELL_AT_THE_POLE = Alarm(
    Case("heidenhain", "g1", "head-ac"),
    0.15,
    10.0,
    """GOTO/0.8411,-0.3935,0.2380,0.0000000,0.0000000,1.0000000
FEDRAT/IPM,441.1154
GOTO/0.8372,-0.4039,0.2464,0.0000000,0.0000000,1.0000000
GOTO/0.8433,-0.3951,0.2464,0.0003544,0.0018964,0.9999981
DELAY/1.5
GOTO/0.7948,-0.4921,0.2464,0.0003544,0.0018964,0.9999981
FEDRAT/IPM,712.9694
GOTO/0.7681,-0.5148,0.0831,0.0003544,0.0018964,0.9999981
GOTO/0.7684,-0.5148,0.0831,-0.0000465,0.0011347,0.9999994
GOTO/0.7710,-0.5236,0.0831,-0.0368166,-0.0189319,0.9991427
""",
    inch=True,
)

#: a change of feed near the pole, where the tool stands already as it should only after it
FEED_AT_THE_POLE = Alarm(
    Case("haas", "g1", "head-ac"),
    0.15,
    10.0,
    """GOTO/0.0000,0.0000,0.0000,0.0000000,0.0000000,1.0000000
FEDRAT/IPM,441.0106
GOTO/-0.8513,1.7448,0.0000,0.0004237,-0.0004888,0.9999998
FEDRAT/IPM,330.7936
GOTO/-0.8513,1.7448,0.0000,0.0004237,-0.0004888,0.9999998
GOTO/-0.8513,1.7448,0.0000,-0.0000603,0.0001530,1.0000000
GOTO/-0.8514,1.7447,-0.0002,-0.5918873,-0.4427668,0.6735184
GOTO/-0.8514,1.7450,-0.0002,-0.5429070,-0.4419728,0.7140812
GOTO/-0.8431,1.7470,0.0102,-0.5429070,-0.4419728,0.7140812
""",
    inch=True,
)

#: where the walk leaves a corner late, its nearest blocks are many blocks before
LATE_AT_THE_POLE = Alarm(
    Case("fanuc", "g1", "xyzbc-trt", tcp=False),
    0.001,
    10.0,
    """GOTO/0.0000,0.0000,0.0000,0.0000000,0.0000000,1.0000000
FEDRAT/IPM,843.4290
GOTO/0.0267,-0.0242,-0.3811,-0.0000180,0.0020016,0.9999980
GOTO/-0.6215,-0.0084,-0.3811,-0.0000180,0.0020016,0.9999980
GOTO/-0.6215,-0.0084,-0.3811,0.3616019,0.1972559,0.9112267
GOTO/-0.6596,-1.6179,-0.3811,0.3616019,0.1972559,0.9112267
""",
    inch=True,
)

#: the last poses are so near that the walk takes the end of the text for one of them
END_WITHIN_DIGITS = Alarm(
    Case("fanuc", "g1", "xyzac-trt"),
    0.001,
    50.0,
    """GOTO/-31.8783,-69.6021,12.3322,0.9961650,-0.0820129,-0.0304816
FEDRAT/MMPM,730.5880
GOTO/-28.4166,-72.4353,12.3322,0.0546999,0.7345930,-0.6762995
GOTO/-28.4166,-72.4354,12.3321,0.0546999,0.7345930,-0.6762995
GOTO/-28.4165,-72.4355,12.3322,0.0546999,0.7345930,-0.6762995
""",
)

#: a pose that must be passed is two blocks before the one it is looked for in
EXACT_WITHIN_DIGITS = Alarm(
    Case("haas", "g1", "xyzbc-trt"),
    0.01,
    50.0,
    """GOTO/90.6764,-23.5104,-30.1309,0.0000000,0.0000000,1.0000000
CUTCOM/LEFT,XYPLAN
FEDRAT/MMPM,100.0
GOTO/55.0152,-50.9585,-30.1309
GOTO/55.0153,-50.9582,-30.1309
GOTO/55.0153,-50.9582,-30.1309
GOTO/55.0153,-50.9583,-30.1310
GOTO/55.0913,-51.1766,-30.1310
GOTO/54.9992,-51.7100,-30.1310
""",
)

#: the way of the axis point that timed a block is not what its rotary words say
TIMED_AT_THE_POLE = Alarm(
    Case("siemens", "g1", "xyzac-trt", tcp=False),
    0.15,
    10.0,
    """FEDRAT/MMPM,294.3645
GOTO/-1.1920,5.1496,-4.5329,0.0000000,0.0000000,1.0000000
GOTO/-1.1920,5.1496,-4.5329,0.0001991,0.0000301,1.0000000
""",
)

#: several poses a digit apart, each with a feed, between which the path goes to and fro
FEED_WITHIN_DIGITS = Alarm(
    Case("siemens", "g1", "head-table-bc", tcp=False),
    0.15,
    50.0,
    """GOTO/-0.3808,-0.2326,0.3426,0.0014362,-0.0016092,0.9999977
FEDRAT/MMPM,1.9795
GOTO/-0.3262,0.4129,0.3426,-0.3200766,0.4127683,0.8527446
GOTO/-0.3261,0.4127,0.3426,-0.3200766,0.4127683,0.8527446
GOTO/-0.3261,0.4128,0.3427,-0.3200766,0.4127683,0.8527446
GOTO/-0.3262,0.4129,0.3420,-0.3200766,0.4127683,0.8527446
FEDRAT/0.3757,MMPR
GOTO/-0.3263,0.4129,0.3420,-0.3200766,0.4127683,0.8527446
""",
)

#: a pose that must be passed, found several blocks from where it is since the axis tells little
EXACT_AT_THE_POLE = Alarm(
    Case("heidenhain", "g1", "table-ac"),
    0.15,
    10.0,
    """GOTO/0.0030,0.0024,-0.0000,0.0002552,0.0008903,0.9999996
GOTO/0.0027,0.0036,0.0000,0.0002552,0.0008903,0.9999996
GOTO/0.0026,0.0037,0.0001,-0.0001103,-0.0001169,1.0000000
GOTO/0.0228,-0.0085,0.0001,0.1479951,0.0243007,-0.9886895
""",
)

#: a turn that begins with a tiny move, at which the walk stays
PURE_TURN = Alarm(
    Case("generic", "g1", "nutated-bc"),
    0.04,
    10.0,
    """GOTO/0.0000,0.0000,0.0000,-0.0024753,-0.0002965,0.9999969
GOTO/-0.0000,0.0000,-0.0000,0.0338193,-0.0009954,0.9994275
GOTO/-0.0000,0.0000,-0.0000,0.0001778,-0.0000205,1.0000000
GOTO/-0.0000,0.0000,-0.0000,-0.0027428,-0.0125998,0.9999169
GOTO/1.8534,-1.0989,1.0331,0.0000111,0.0004129,0.9999999
GOTO/1.8534,-1.0989,1.0331,0.0000075,-0.0000093,1.0000000
GOTO/1.8534,-1.0989,1.0331,-0.5004361,-0.0168184,0.8656101
""",
    inch=True,
)

#: compensation ends with the program, near the pole
LAST_TIDIED = Alarm(
    Case("fanuc", "g1", "xyzbc-trt"),
    0.15,
    50.0,
    """GOTO/0.7261,0.6440,-0.0003,0.0108990,-0.0259442,0.9996040
CUTCOM/LEFT,XYPLAN
GOTO/0.7261,0.6440,-0.0003,-0.0004832,-0.0006688,0.9999997
""",
)

#: the last pose is a margin from where the walk ends, and a rounding more from the end
END_TWO_DIGITS_BACK = Alarm(
    Case("generic", "g1", "head-ac"),
    0.15,
    50.0,
    """GOTO/-0.1857,0.1952,-0.0008,-0.2044695,-0.9785411,0.0254853
GOTO/-0.3333,-0.0281,0.0293,-0.2044695,-0.9785411,0.0254853
GOTO/-0.3332,-0.0281,0.0293,-0.2044695,-0.9785411,0.0254853
GOTO/-0.3334,-0.0282,0.0291,-0.2044695,-0.9785411,0.0254853
""",
)

#: the tool turns aside and back the same way: nearest is as well the way back
THERE_AND_BACK = Alarm(
    Case("fanuc", "g1", "head-table-bc", tcp=False),
    0.04,
    50.0,
    """GOTO/0.0000,0.0000,0.0000,0.0000000,0.0000000,1.0000000
GOTO/-2.2270,11.2304,9.4196,0.0011097,0.0002101,0.9999994
GOTO/-2.1731,11.1019,9.4196,0.0012436,0.0002134,0.9999992
GOTO/-2.1613,11.0862,9.4278,0.0012436,0.0002134,0.9999992
GOTO/-2.1435,11.0910,9.4139,-0.0477237,0.0243034,0.9985649
GOTO/-2.1435,11.0910,9.4139,0.0000000,0.0000000,1.0000000
GOTO/-2.1554,11.0854,9.4360,-0.0002197,0.0000106,1.0000000
GOTO/-1.6508,45.1454,26.2528,-0.0001353,0.0000065,1.0000000
GOTO/8.8318,-38.4309,26.2529,-0.0008265,0.0033310,0.9999941
""",
)

#: standing at the pole is as near to what comes later, and many blocks stand there
PAST_THE_POLE = Alarm(
    Case("siemens", "g1", "xyzac-trt", tcp=False),
    0.001,
    10.0,
    """CUTCOM/LEFT,XYPLAN
GOTO/-2.9031,1.6844,-1.0032,0.0007930,-0.0017922,0.9999981
GOTO/-2.9026,1.6840,-1.0032,-0.0001548,0.0000209,1.0000000
GOTO/-2.9049,1.5044,-1.2539,0.0332062,0.0102047,0.9993964
GOTO/-2.8722,1.5100,-1.2563,-0.0064349,0.0065858,0.9999576
GOTO/-2.8722,1.5100,-1.2563,0.0024546,-0.0009847,0.9999965
GOTO/-2.8724,1.5097,-1.2563,0.0000000,0.0000000,1.0000000
GOTO/-3.0042,1.4590,-1.2672,-0.0806423,-0.0293891,0.9963097
""",
    inch=True,
)

#: compensation cancelled before the last moves, which are within what the pole leaves open
CANCELLED_NEAR_THE_END = Alarm(
    Case("linuxcnc", "g1", "xyzbc-trt"),
    0.15,
    10.0,
    """GOTO/-31.1036,-38.9167,43.3778,0.0060038,0.0018345,0.9999803
FEDRAT/MMPM,557.6766
CUTCOM/LEFT,XYPLAN
GOTO/-8.5474,-56.3122,57.7454,0.0060038,0.0018345,0.9999803
CUTCOM/OFF
GOTO/-8.5473,-56.3127,57.7454,0.0067936,0.0020855,0.9999747
SPINDL/CLW,RPM,500
GOTO/-8.5473,-56.3127,57.7454,0.0000530,0.0000230,1.0000000
""",
)

#: the same line to and fro: all of it is as near to its first run
TO_AND_FRO = Alarm(
    Case("siemens", "g1", "table-bc"),
    0.04,
    10.0,
    """GOTO/0.0133,-0.3122,0.2502,-0.0014866,-0.0000357,0.9999989
GOTO/0.0134,-0.3122,0.2504,0.4305919,0.4442340,0.7856506
GOTO/0.5291,-0.1036,0.0988,0.4304429,0.4441337,0.7857889
GOTO/0.0139,-0.3120,0.2503,0.4304425,0.4441338,0.7857891
GOTO/0.5286,-0.1038,0.0990,0.4304417,0.4441343,0.7857892
""",
)

#: the vertex that is farthest off keeps its place when those about it are assigned anew
AS_FAR_AS_BEFORE = Alarm(
    Case("heidenhain", "g1", "head-table-bc"),
    0.15,
    50.0,
    """GOTO/0.0000,0.0000,0.0000,0.0000000,0.0000000,1.0000000
GOTO/0.0120,0.0069,0.0000,-0.0579961,0.0018127,0.9983152
GOTO/0.0123,0.0068,0.0000,0.0010441,0.0003911,0.9999994
STOP
GOTO/-0.7346,1.8036,0.0724,0.0000317,-0.0000153,1.0000000
GOTO/-0.7345,1.8036,0.0724,0.0170473,-0.0069459,0.9998306
""",
    inch=True,
)

#: written longer than the original near the pole, where it comes back to where a long move has ended
ANCHOR_ON_A_LONG_MOVE = Alarm(
    Case("mitsubishi", "g1", "table-ac", tcp=False),
    0.001,
    50.0,
    """GOTO/7.6171,-11.8520,-35.4199,-0.0402707,0.0418393,0.9983124
GOTO/-33.8614,-28.3096,-63.2653,0.0075584,-0.0009417,0.9999710
GOTO/-4.8880,-47.9598,-44.4754,-0.0000066,0.0000032,1.0000000
GOTO/-4.8879,-47.9597,-44.4754,-0.0000066,0.0000032,1.0000000
GOTO/-4.8869,-47.9685,-44.4754,-0.0000066,0.0000032,1.0000000
GOTO/-4.8864,-47.9685,-44.4754,0.0304149,0.1084979,0.9936313
GOTO/-4.8864,-47.9685,-44.4754,-0.0000017,-0.0000091,1.0000000
GOTO/-4.8864,-47.9685,-44.4754,0.0000015,0.0000009,1.0000000
""",
)

#: written longer than the original near the pole, where what is nearest has been passed by path length
ANCHOR_PASSED_BY = Alarm(
    Case("linuxcnc", "g1", "table-bc", tcp=False),
    0.003,
    10.0,
    """GOTO/61.0623,15.0665,-2.5191,-0.0201316,-0.0088294,0.9997584
GOTO/60.8274,15.1905,-2.5191,0.0574267,-0.0083738,0.9983146
GOTO/60.8256,15.1883,-2.5194,-0.0000227,-0.0000093,1.0000000
GOTO/60.8260,15.1881,-2.5186,0.0000389,-0.0004899,0.9999999
GOTO/24.4357,45.9188,-2.5186,-0.3011295,-0.6747439,-0.6738262
GOTO/24.4357,45.9188,-2.5186,-0.0000006,-0.0000070,1.0000000
""",
)

#: a rapid within one digit of the pose before it, on axes that a turned table has turned as well
RAPID_WITHIN_DIGITS = Alarm(
    Case("mitsubishi", "g1", "table-bc", tcp=False),
    0.15,
    50.0,
    """GOTO/-0.3497,-0.3117,0.0008,-0.7089245,0.5751762,0.4081646
RAPID
GOTO/-0.3496,-0.3117,0.0009,-0.7089245,0.5751762,0.4081646
""",
)

#: a stop where the path goes a digit aside, stands and comes back: nearest is beyond the repeated pose
STOP_AND_REPEATED = Alarm(
    Case("fanuc", "g6.2"),
    0.04,
    10.0,
    """GOTO/0.0000,0.0000,0.0000,0.0000000,0.0000000,1.0000000
GOTO/0.0000,-0.0000,0.0000,-0.0039287,0.0321197,0.9994763
GOTO/-0.0000,0.0000,0.0000,-0.2416650,-0.0156529,0.9702335
GOTO/-0.4324,1.0075,-1.3139,0.1060130,-0.7250320,-0.6805070
STOP
GOTO/-0.4325,1.0075,-1.3139,0.1060130,-0.7250320,-0.6805070
GOTO/-0.4325,1.0075,-1.3139,0.1060130,-0.7250320,-0.6805070
GOTO/-0.4324,1.0075,-1.3139,0.1045133,-0.7251242,-0.6806407
GOTO/-0.4325,1.0075,-1.3139,0.1045133,-0.7251242,-0.6806407
""",
    inch=True,
)

#: the axis point alone is too far off, but tip and axis point together could be so far
AXIS_ALONE = Alarm(
    Case("mitsubishi", "g1", "table-bc", tcp=False),
    0.003,
    50.0,
    """GOTO/-0.0003,0.0182,0.0000,0.9506276,-0.3100454,-0.0133807
GOTO/-0.0112,0.0246,0.0000,0.9506276,-0.3100454,-0.0133807
GOTO/-0.0112,0.0246,0.0000,0.9506276,-0.3100454,-0.0133807
GOTO/-0.0112,0.0246,0.0000,0.9506274,-0.3100461,-0.0133797
GOTO/-0.0112,0.0246,0.0000,0.9506274,-0.3100461,-0.0133797
GOTO/-0.0112,0.0246,0.0000,0.9506274,-0.3100461,-0.0133798
GOTO/-0.0112,0.0246,0.0000,0.9506282,-0.3100353,-0.0135660
GOTO/-0.0112,0.0246,0.0000,0.9512436,-0.3081481,-0.0134286
""",
    inch=True,
)

#: two cycles in one hole, a second tool between them; the way back from the first is also the next move
TWO_CYCLES_IN_A_HOLE = Alarm(
    Case("fanuc", "g1"),
    0.01,
    10.0,
    """GOTO/25,50,25
CYCLE/DRILL,FEDTO,5,MMPM,1700,RAPTO,3,RTRCTO,25,DWELL,0.5
GOTO/25,50,0
CYCLE/OFF
COOLNT/ON
LOADTL/18
SPINDL/5942,RPM,CLW
RAPID
GOTO/25,50,25
CYCLE/DRILL,FEDTO,20,MMPM,800,RAPTO,3,RTRCTO,25
GOTO/25,50,0
CYCLE/OFF
""",
)

#: a cycle that is not carried out, and words behind it where the tool never went
NOT_TAPPED = Alarm(
    Case("haas", "g1", "table-ac"),
    0.01,
    10.0,
    """GOTO/7,2,46
CYCLE/TAP,FEDTO,12.5,MMPM,200,RAPTO,3,RTRCTO,25
GOTO/7,2,21
GOTO/-23,-31,-33
CYCLE/OFF
LOADTL/29
SPINDL/900,RPM,CLW
RAPID
GOTO/7,2,46
CYCLE/DEEP,FEDTO,15,MMPM,373,RAPTO,3,RTRCTO,25
GOTO/-23,-31,-33
GOTO/7,2,21
CYCLE/OFF
LOADTL/3
RAPID
GOTO/7,2,46
CYCLE/TAP,FEDTO,12.5,MMPM,200,RAPTO,3,RTRCTO,25
GOTO/7,2,21
CYCLE/OFF
LOADTL/4
SPINDL/950,RPM,CLW
RAPID
GOTO/7,2,86
""",
)

#: a tool that is loaded and moves nothing has no offset
LAST_TOOL = Alarm(
    Case("fanuc", "g1", "table-ac", tcp=False),
    0.01,
    10.0,
    """GOTO/0,0,0,0,0,1
FEDRAT/MMPM,100
GOTO/5,0,0
LOADTL/2
SPINDL/900,RPM,CLW
SPINDL/OFF
""",
)

#: cycles that are not drilled in a hole where another one is: the tool stands over it already, a tool change between
TAPPED_AND_DRILLED = Alarm(
    Case("mitsubishi", "g6.2"),
    0.002,
    50.0,
    """GOTO/-69.2,36.9,7.7
RAPID
GOTO/16.8,-20.2,44.3
CYCLE/TAP,FEDTO,23.1,MMPM,277,RAPTO,3,RTRCTO,25
GOTO/16.8,-20.2,19.3
CYCLE/OFF
LOADTL/16
SPINDL/1724,RPM,CLW
RAPID
GOTO/16.8,-20.2,44.3
CYCLE/TAP,FEDTO,6.9,MMPM,118,RAPTO,3,RTRCTO,25
GOTO/16.8,-20.2,19.3
CYCLE/OFF
SPINDL/OFF
RAPID
GOTO/16.8,-20.2,44.3
CYCLE/DRILL,FEDTO,24.3,MMPM,101,RAPTO,3,RTRCTO,25
GOTO/16.8,-20.2,19.3
CYCLE/OFF
COOLNT/OFF
LOADTL/37
SPINDL/1568,RPM,CLW
RAPID
GOTO/16.8,-20.2,99.3
SPINDL/OFF
""",
)

#: the same place is left behind the last hole, said again behind a tool change, and over a hole that is not drilled
THREE_TIMES_THERE = Alarm(
    Case("heidenhain", "g1", "head-table-bc"),
    0.003,
    10.0,
    """GOTO/-19.1206,27.0422,-11.4127,0.2887762,0.2516499,0.9237319
CYCLE/DRILL,FEDTO,25,MMPM,613,RAPTO,3,RTRCTO,25,DWELL,0.5
GOTO/8.275,-6.091,10.132,0.2887762,0.2516499,0.9237319
GOTO/-26.34,20.751,-34.506,0.2887762,0.2516499,0.9237319
CYCLE/OFF
LOADTL/28
SPINDL/1934,RPM,CLW
RAPID
GOTO/-19.1206,27.0422,-11.4127,0.2887762,0.2516499,0.9237319
CYCLE/TAP,FEDTO,17,MMPM,401,RAPTO,3,RTRCTO,25,DWELL,0.5
GOTO/8.275,-6.091,10.132,0.2887762,0.2516499,0.9237319
GOTO/-3.016,2.152,-7.352,0.2887762,0.2516499,0.9237319
GOTO/-26.34,20.751,-34.506,0.2887762,0.2516499,0.9237319
CYCLE/OFF
LOADTL/19
RAPID
GOTO/31.3771,14.041,84.0306,0.2887762,0.2516499,0.9237319
""",
)

#: a hole that is not drilled, beside the pose above it by digits of the CL file: the rapid to it is none along the tool
HOLE_BESIDE_ITS_POSE = Alarm(
    Case("linuxcnc", "g1", "xyzbc-trt", tcp=False),
    0.008,
    28.0,
    """GOTO/-26.3356,-32.5305,-5.6760,-0.0290232,-0.1672982,0.9854791
CYCLE/TAP,FEDTO,21.3650,MMPM,484.5854,RAPTO,3,RTRCTO,25
GOTO/-25.6100,-28.3480,-30.3130,-0.0290232,-0.1672982,0.9854791
CYCLE/OFF
LOADTL/35
RAPID
GOTO/-26.3356,-32.5305,-5.6760,-0.0290232,-0.1672982,0.9854791
CYCLE/BORE,FEDTO,18.9377,MMPM,838.9355,RAPTO,3,RTRCTO,25
GOTO/-25.6100,-28.3480,-30.3130,-0.0290232,-0.1672982,0.9854791
CYCLE/OFF
LOADTL/19
RAPID
GOTO/-27.9319,-41.7319,48.5253,-0.0290232,-0.1672982,0.9854791
""",
)

#: nothing moves at a hole that is not drilled, so that M5 is said, and M3 behind the tool change, in one place
STOPPED_BEFORE_A_TOOL = Alarm(
    Case("linuxcnc", "g1", "table-bc"),
    0.001,
    60.0,
    """SPINDL/2960,RPM,CLW
RAPID
GOTO/-9.5380,36.9750,28.9630
CYCLE/DRILL,FEDTO,7.4967,MMPM,669.3485,RAPTO,3,RTRCTO,25
GOTO/-9.5380,36.9750,3.9630
CYCLE/OFF
SPINDL/OFF
RAPID
GOTO/-9.5380,36.9750,28.9630
CYCLE/TAP,FEDTO,6.8161,MMPM,746.6020,RAPTO,3,RTRCTO,25
GOTO/-9.5380,36.9750,3.9630
CYCLE/OFF
LOADTL/25
SPINDL/17333,RPM,CLW
RAPID
GOTO/-9.5380,36.9750,83.9630
LOADTL/36
SPINDL/15357,RPM,CLW
RAPID
GOTO/-23.9270,-22.5140,26.2590
LOADTL/26
SPINDL/753,RPM,CLW
SPINDL/OFF
""",
)

#: a dwell in revolutions at the bottom of a hole: 200 ms
DWELL_IN_REVOLUTIONS = Alarm(
    Case("fanuc", "g1"),
    0.01,
    10.0,
    """GOTO/0,0,30
SPINDL/900,RPM,CLW
CYCLE/DRILL,FEDTO,10,MMPM,120,RAPTO,3,RTRCTO,25,DWELL,REV,3
GOTO/0,0,0
CYCLE/OFF
RAPID
GOTO/0,0,80
""",
)

ALARMS = {
    "tapped and drilled": TAPPED_AND_DRILLED,
    "three times there": THREE_TIMES_THERE,
    "two cycles in a hole": TWO_CYCLES_IN_A_HOLE,
    "not tapped": NOT_TAPPED,
    "last tool": LAST_TOOL,
    "creeping": CREEPING,
    "dwell at the pole": DWELL_AT_THE_POLE,
    "feed at the pole": FEED_AT_THE_POLE,
    "late at the pole": LATE_AT_THE_POLE,
    "end within digits": END_WITHIN_DIGITS,
    "exact within digits": EXACT_WITHIN_DIGITS,
    "timed at the pole": TIMED_AT_THE_POLE,
    "feed within digits": FEED_WITHIN_DIGITS,
    "exact at the pole": EXACT_AT_THE_POLE,
    "pure turn": PURE_TURN,
    "last tidied": LAST_TIDIED,
    "end two digits back": END_TWO_DIGITS_BACK,
    "there and back": THERE_AND_BACK,
    "past the pole": PAST_THE_POLE,
    "cancelled near the end": CANCELLED_NEAR_THE_END,
    "to and fro": TO_AND_FRO,
    "as far as before": AS_FAR_AS_BEFORE,
    "anchor on a long move": ANCHOR_ON_A_LONG_MOVE,
    "anchor passed by": ANCHOR_PASSED_BY,
    "rapid within digits": RAPID_WITHIN_DIGITS,
    "stop and repeated": STOP_AND_REPEATED,
    "axis alone": AXIS_ALONE,
    "dwell in revolutions": DWELL_IN_REVOLUTIONS,
    "stopped before a tool": STOPPED_BEFORE_A_TOOL,
    "hole beside its pose": HOLE_BESIDE_ITS_POSE,
}


@pytest.mark.parametrize("name", share(ALARMS, 2))
def test_what_is_written_passes(name: str) -> None:
    alarm = ALARMS[name]
    assert alarm.verified(alarm.text).problems == ()


@pytest.mark.parametrize("name", ["creeping", "axis alone"])
def test_blocks_as_fast_as_f_can_say_are_right_in_a_plan_too(name: str) -> None:
    assert ALARMS[name].verified(ALARMS[name].text, slower=True).problems == ()


def test_tip_that_turns_round_before_the_axis_point_is_not_going_back() -> None:
    """By the paper's method the tip goes back along its way while the axis point goes on."""
    cl = """UNITS/INCHES
LOADTL/12
RAPID
GOTO/-1.8756,1.9192,1.7889,0.0000000,0.3782657,0.9256971
FEDRAT/22.0079,IPM
GOTO/-1.8756,1.9093,1.7790,0.0000000,0.3782657,0.9256971
GOTO/-1.8658,1.8995,1.7790,0.0000000,0.3782657,0.9256971
GOTO/-1.8756,1.9093,1.7790,0.3782657,0.0000000,0.9256971
FINI
"""
    settings = Settings(tolerance=0.079611, axis_length=2.761, method="zhang2016", lines="dense")
    one = Trial(0, Case("linuxcnc", "g1", "head-ac"), settings, "inch", cl)
    assert judged(one, read(cl.encode(), name="part.cls")) == ("passed", "")


#: the tip stands, so only the axis point tells how fast a block is
STANDING = Alarm(
    Case("fanuc", "g1", "head-ac", tcp=False),
    0.01,
    10.0,
    """GOTO/10.0,20.0,-30.0,0.0,0.5,0.8660254
FEDRAT/MMPM,40.0
GOTO/10.0,20.0,-30.0,0.3,0.4,0.8660254
GOTO/30.0,20.0,-30.0,0.3,0.4,0.8660254
""",
)


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_time_of_a_standing_tip_is_still_compared(factor: float) -> None:
    assert STANDING.verified(STANDING.text).problems == ()
    lines = STANDING.text.splitlines()
    timed = [k for k, line in enumerate(lines) if line.startswith("G1 ")]
    assert lines.index("G93") < timed[0]
    for k in timed[1 : len(timed) // 2 : 3]:
        words, rate = lines[k].split(" F")
        wrong = [*lines[:k], f"{words} F{factor * float(rate):.4f}", *lines[k + 1 :]]
        found = STANDING.verified("\n".join(wrong)).problems
        assert [(problem.code, problem.nc_line) for problem in found] == [("CS541", k + 1)]


#: the tip moves by less than a coarse tolerance, and by more than the one that the program is written with
HARDLY_MOVING = Alarm(
    Case("linuxcnc", "g1", "xyzac-trt"),
    0.0005,
    10.0,
    """GOTO/0.0,0.0,0.0,0.0,0.0,1.0
FEDRAT/MMPM,1000.0
GOTO/0.03,0.02,0.0,0.1045285,0.0,0.9945219
GOTO/0.06,0.04,0.0,0.0174524,0.0,0.9998477
GOTO/0.09,0.0,0.0,0.1045285,0.0,0.9945219
GOTO/0.12,0.02,0.0,0.2079117,0.0,0.9781476
""",
)


@pytest.mark.parametrize("tolerance", [0.0005, 0.002, 0.005, 0.01, 0.02, 0.04, 0.1])
def test_timed_blocks_may_be_of_any_tolerance_up_to_the_one_of_the_check(tolerance: float) -> None:
    alarm = replace(HARDLY_MOVING, tolerance=tolerance)
    lines = HARDLY_MOVING.text.splitlines()
    assert alarm.verified("\n".join(lines)).problems == ()
    timed = lines.index("G93") + 1
    words, rate = lines[timed].split(" F")
    for factor in (0.3, 3.0):
        wrong = [*lines[:timed], f"{words} F{factor * float(rate):.3f}", *lines[timed + 1 :]]
        found = alarm.verified("\n".join(wrong)).problems
        assert [(problem.code, problem.nc_line) for problem in found] == [("CS541", timed + 1)]


#: without tip control, all blocks timed, in moves with feeds of their own
TIMED = Alarm(
    Case("fanuc", "g1", "xyzbc-trt", tcp=False),
    0.005,
    10.0,
    """GOTO/0,0,0,0,0.1045285,0.9945219
FEDRAT/MMPM,400.0
GOTO/8,1,0,0.1045285,0,0.9945219
FEDRAT/MMPM,700.0
GOTO/15,5,1,0.1736482,0,0.9848078
""",
)


def test_feed_of_the_neighbour_is_found_where_blocks_are_timed() -> None:
    lines = TIMED.text.splitlines()
    assert TIMED.verified(TIMED.text).problems == ()
    timed = [k for k in range(lines.index("G93") + 1, len(lines)) if " F" in lines[k]]
    for factor, some in ((7 / 4, timed[: len(timed) // 4]), (4 / 7, timed[-len(timed) // 4 :])):
        wrong = list(lines)
        for k in some:
            words, rate = lines[k].split(" F")
            wrong[k] = f"{words} F{factor * float(rate):.3f}"
        found = TIMED.verified("\n".join(wrong)).problems
        assert [(problem.code, problem.nc_line) for problem in found] == [("CS541", some[0] + 1)]
        for k in some[:: len(some) // 4]:
            found = TIMED.verified("\n".join([*lines[:k], wrong[k], *lines[k + 1 :]])).problems
            assert [(problem.code, problem.nc_line) for problem in found] == [("CS541", k + 1)]


def test_time_of_a_dwell_in_revolutions_is_compared() -> None:
    text = DWELL_IN_REVOLUTIONS.text
    assert "G4 P200" in text
    found = DWELL_IN_REVOLUTIONS.verified(text.replace("G4 P200", "G4 P300")).problems
    assert [problem.code for problem in found] == ["CS556"]


def test_cycles_of_one_hole_are_told_apart() -> None:
    """The first is as deep as it should be, not the deepest; its dwell is its own."""
    lines = TWO_CYCLES_IN_A_HOLE.text.splitlines()
    first, second = (
        next(k for k, line in enumerate(lines) if f" Z{depth} " in line) for depth in ("-5.0000", "-20.0000")
    )
    for k, old, new, code in (
        (first, "-5.0000", "-6.0000", "CS562"),
        (second, "-20.0000", "-19.0000", "CS562"),
        (first, "F1700.", "F1600.", "CS541"),
    ):
        wrong = [*lines[:k], lines[k].replace(old, new), *lines[k + 1 :]]
        found = TWO_CYCLES_IN_A_HOLE.verified("\n".join(wrong)).problems
        assert (code, k + 1) in [(problem.code, problem.nc_line) for problem in found]
    dwell = lines.index("G4 P500")
    found = TWO_CYCLES_IN_A_HOLE.verified("\n".join(lines[:dwell] + lines[dwell + 1 :])).problems
    assert [problem.code for problem in found] == ["CS556"]
    moved = [*lines[:dwell], *lines[dwell + 1 : second + 1], lines[dwell], *lines[second + 1 :]]
    assert "CS556" in [problem.code for problem in TWO_CYCLES_IN_A_HOLE.verified("\n".join(moved)).problems]


def test_holes_in_one_line_to_the_digits_of_the_cl_file() -> None:
    """Up along the tool, without a retract, to a hole that is in the line of the one before but for the last digit."""
    cl = (
        "UNITS/MM\nLOADTL/1\nSPINDL/2000,RPM,CLW\nCYCLE/DRILL,FEDTO,4.0,MMPM,100,RAPTO,3,RTRCTO,20\n"
        "GOTO/37.4690,21.4146,-13.0597,0.0506639,-0.0575490,0.9970563\nLOADTL/3\n"
        "GOTO/38.0770,20.7240,-1.0950,0.0506639,-0.0575490,0.9970563\nSPINDL/OFF\nFINI\n"
    )
    form, stream = choose_form("generic", machine=load_machine("head-table-bc")), io.BytesIO()
    postprocess(cl.encode(), stream, Settings(tolerance=0.00214, axis_length=20.0), form=form, verify=False)
    how = {"control": "generic", "machine": form.machine, "tolerance": 0.00214, "axis_length": 20.0}
    assert not verify(read(cl.encode()), stream.getvalue(), **how).problems
