"""Uploads: multipart bodies, straight to the disk."""

import asyncio
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Final

from aiohttp import BodyPartReader, MultipartReader, web

from cdhr_host.errors import JobError
from cdhr_host.serve.folder import Entry, Folder, Upload
from cdhr_host.serve.names import refused

CHUNK: Final = 1 << 16
CHUNK_WITHIN: Final = 30.0
"""s for each chunk of a body"""
FIELD_MAX: Final = 4096
"""bytes of a form field that is no file"""
PARTS_MAX: Final = 16


@dataclass(frozen=True, slots=True)
class Form:
    """What came with an upload."""

    entry: Entry
    fields: dict[str, str]

    def wants(self, name: str) -> bool:
        """Whether a field says true."""
        return self.fields.get(name, "").strip().lower() in {"true", "1", "yes"}


async def receive(request: web.Request, folder: Folder) -> Form:
    """Read a multipart body; its file is in the folder afterwards. JobError for what is refused."""
    if not request.content_type.startswith("multipart/"):
        raise refused("an upload is multipart/form-data", "send a field named 'file'", kind="form")
    fields: dict[str, str] = {}
    upload: Upload | None = None
    reader = await request.multipart()
    with ExitStack() as stack:
        for _ in range(PARTS_MAX):
            part = await _next(reader)
            if part is None:
                break
            if part.filename is None:
                fields[(part.name or "")[:64]] = await _text(part)
            elif upload is None:
                upload = stack.enter_context(folder.receive(part.filename))
                await _file(part, upload)
            else:
                raise refused("one file in a form", kind="form")
        if upload is None:
            raise refused("the form holds no file", "send a field named 'file' with a file name", kind="form")
        if fields.get("path", "").strip("/"):
            upload.put_in(fields["path"].strip("/"))
        return Form(await asyncio.to_thread(upload.keep), fields)


async def _next(reader: MultipartReader) -> BodyPartReader | None:
    async with asyncio.timeout(CHUNK_WITHIN):
        part = await reader.next()
    if part is not None and not isinstance(part, BodyPartReader):
        raise refused("a form inside a form", kind="form")
    return part


async def _text(part: BodyPartReader) -> str:
    data = b""
    while chunk := await _chunk(part):
        data += chunk
        if len(data) > FIELD_MAX:
            name = (part.name or "")[:40]
            raise refused(f"the field '{name}' is longer than {FIELD_MAX} bytes", kind="form")
    return data.decode("utf-8", "replace")


async def _file(part: BodyPartReader, upload: Upload) -> None:
    while chunk := await _chunk(part):
        upload.write(chunk)


async def _chunk(part: BodyPartReader) -> bytes:
    async with asyncio.timeout(CHUNK_WITHIN):
        return bytes(await part.read_chunk(CHUNK))


def reason(error: JobError) -> str:
    """A refusal for a client, in one line."""
    problem = error.problems[0]
    return f"{problem.message} ({problem.hint})" if problem.hint else problem.message
