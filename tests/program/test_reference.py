"""G28: where it goes, with and without clay on the bed."""

from program_reading import ALL_AIR, moves, profile, read, shown, warnings

from cdhr_host.values import Moves


def test_at_the_reference_it_only_stops() -> None:
    assert shown(read("G28\n")) == ["1 stop"]


def test_without_clay_across_and_down() -> None:
    assert shown(read("G0 X50 Y20 Z10\nG28 X0 Y0\n")) == [
        "1 move to 50 20 10 at 100",
        "2 stop",
        "2 move to 0 0 10 at 100",
        "2 move to 0 0 0 at 100",
        "2 stop",
    ]


def test_from_below_it_goes_up_first() -> None:
    assert moves(read("G28\n", at=(30, 0, -10))) == [[30, 0, 0], [0, 0, 0]]


def test_clay_far_from_the_axis_is_cleared_then_it_descends() -> None:
    text = "G0 X150 Z2\nG1 Y50 E10 F600\nG28 Z\n"
    assert moves(read(text))[2:] == [[150, 50, 22], [0, 0, 22], [0, 0, 0]]


def test_clay_near_the_axis_keeps_it_up() -> None:
    commands = read("G0 X150 Z2\nG1 X-150 Y1 E10 F600\nG0 X-160 Z5\nG28\nG28\n")
    assert moves(commands)[3:] == [[-160, 1, 22], [0, 0, 22]]
    assert len(warnings(commands)) == 1
    assert warnings(commands)[0].startswith("G28 stays 20 mm above the print: clay is 0.5 mm from")


def test_nearness_counts_along_the_segment_and_for_the_margin() -> None:
    tight = profile(bed={"clear_radius_mm": 0.4})
    assert moves(read("G0 X150 Z2\nG1 X-150 Y1 E10 F600\nG28\n", tight))[-1] == [0, 0, 0]


def test_priming_and_air_count_as_clay() -> None:
    assert moves(read("G1 E5 F60\nG0 X200\nG28\n"))[-1] == [0, 0, 20]
    assert moves(read("M106\nG0 X10\nM107\nG0 X200\nG28\n", ALL_AIR))[-1] == [0, 0, 20]
    assert moves(read("M106\nG3 X200 R100 F600\nM107\nG28\n", ALL_AIR))[-1] == [0, 0, 20]


def test_travel_is_no_clay() -> None:
    assert moves(read("G0 X10 Z50\nG0 X200 Z0\nG28\n"))[-1] == [0, 0, 0]


def test_a_nozzle_above_the_way_stays_at_its_height() -> None:
    assert moves(read("G1 X200 E5 F600\nG0 Z90\nG28\n"))[2:] == [[0, 0, 90]]


def test_its_moves_are_travel_even_with_the_air_open() -> None:
    commands = read("G0 X200 Z3\nM106\nG28\nG0 X1\n", ALL_AIR)
    way = [item for item in commands if isinstance(item, Moves)]
    assert [batch.air.tolist() for batch in way] == [[0], [0, 0], [200e3]]
    assert way[1].clay.tolist() == [0, 0]


def test_offsets_are_gone_and_the_position_is_the_true_one() -> None:
    commands = read("G1 X10 E5 F600\nG92 X0 Z0\nG28\nG91\nG1 X5\nG90\nG1 X7 Z30\n")
    assert moves(commands)[-3:] == [[0, 0, 20], [5, 0, 20], [7, 0, 30]]


def test_clay_below_the_reference_does_not_block() -> None:
    text = "G0 Z-40\nG1 X5 E5 F600\nG28\n"
    assert moves(read(text, at=(0, 0, -40)))[-2:] == [[5, 0, 0], [0, 0, 0]]
