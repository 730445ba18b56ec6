"""The server of the page: what it reports."""

import asyncio


def test_a_page_that_closes_while_it_is_drawn_is_no_fault(caplog):
    """What fails in the background is reported, but for a message to a page that is no longer there."""
    from tornado.websocket import WebSocketClosedError

    from harvester.explore.server import report_failure  # with Panel, which no other test of this process needs

    loop = asyncio.new_event_loop()
    report_failure(loop, {"message": "of a task", "exception": WebSocketClosedError()})
    assert caplog.text == ""
    report_failure(loop, {"message": "of a task", "exception": ValueError("another fault")})
    assert "another fault" in caplog.text
    loop.close()
